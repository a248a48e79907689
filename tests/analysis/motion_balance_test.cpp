#include "analysis/identification/balance/motion_balance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace swarmcert::identification {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using residuals::Track;

constexpr double kTwoPi = 2 * M_PI, kDegree_rad = M_PI / 180;

/// Sums of sines, whose derivatives are exact.
struct SmoothPath {
  Matrix3d reach_m, rate_1_s, phase;

  explicit SmoothPath(unsigned seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 3; ++k) {
        rate_1_s(axis, k) = kTwoPi * (0.15 + 0.15 * k + 0.1 * uniform(generator));
        reach_m(axis, k) = 0.4 / (1 + k);
        phase(axis, k) = kTwoPi * uniform(generator);
      }
    }
  }
  /// @param order derivative
  Vector3d at(double t, int order) const {
    Vector3d sum = Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 3; ++k)
        sum(axis) += reach_m(axis, k) * std::pow(rate_1_s(axis, k), order) *
                     std::sin(rate_1_s(axis, k) * t + phase(axis, k) + order * M_PI / 2);
    return sum;
  }
};

/// What is wrong with the signals of a log.
struct Faults {
  double velocity_scale = 1, position_lag_s = 0, velocity_lag_s = 0, attitude_lag_s = 0, heading_rad = 0,
         tilt_rad = 0;
  bool is_tilted_in_body = false;
  double yaw_rate_rad_s = 0;  ///< no fault
  double position_noise_m = 4e-4, velocity_noise_m_s = 5e-3;
};

/// Yaw at a constant rate, after a roll that swings.
constexpr double kSwing_rad = 0.2, kSwingRate_1_s = 4;

Matrix3d attitude(double yaw_rate_rad_s, double t) {
  return (AngleAxisd(yaw_rate_rad_s * t, Vector3d::UnitZ()) *
          AngleAxisd(kSwing_rad * std::sin(kSwingRate_1_s * t), Vector3d::UnitX()))
      .toRotationMatrix();
}

Vector3d rates_rad_s(double yaw_rate_rad_s, double t) {
  const Vector3d of_roll(kSwing_rad * kSwingRate_1_s * std::cos(kSwingRate_1_s * t), 0, 0);
  return of_roll + attitude(0, t).transpose() * Vector3d(0, 0, yaw_rate_rad_s);
}

/// A flight of half a minute with noise. The specific force, in W, is that of the path; forces need no model.
Track flight(unsigned seed, const Faults& faults) {
  const SmoothPath path(seed);
  std::mt19937 generator(seed + 1000);
  std::normal_distribution<double> normal;
  const auto noise = [&](double size) {
    return Vector3d(size * normal(generator), size * normal(generator), size * normal(generator));
  };
  Track track;
  track.has_rates = true;
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.01 * i;
    stability::Instant now;
    now.time_s = t;
    now.p_W_m =
        path.at(t - faults.velocity_lag_s - faults.position_lag_s, 0) + noise(faults.position_noise_m);
    now.v_W_m_s =
        faults.velocity_scale * (path.at(t - faults.velocity_lag_s, 1) + noise(faults.velocity_noise_m_s));
    now.R_WB = attitude(faults.yaw_rate_rad_s, t - faults.attitude_lag_s);
    now.omega_B_rad_s = rates_rad_s(faults.yaw_rate_rad_s, t) + noise(0.01);
    const Matrix3d R_WB = attitude(faults.yaw_rate_rad_s, t);
    const Matrix3d tilt = AngleAxisd(faults.tilt_rad, Vector3d::UnitX()).toRotationMatrix();
    const Matrix3d turned = AngleAxisd(faults.heading_rad, Vector3d::UnitZ()).toRotationMatrix() *
                            (faults.is_tilted_in_body ? Matrix3d(R_WB * tilt * R_WB.transpose()) : tilt);
    track.instants.push_back(now);
    track.specific_force_m_s2.emplace_back(
        turned * (path.at(t, 2) + stability::kGravity_m_s2 * Vector3d::UnitZ()) + noise(0.1));
    track.restarts.push_back(0);
    track.cut.push_back(residuals::Cut::kNone);
  }
  return track;
}

std::vector<MotionFault> faults_of_flights(const Faults& faults) {
  std::vector<Track> tracks;
  for (unsigned seed = 1; seed <= 5; ++seed) tracks.push_back(flight(seed, faults));
  return motion_faults(tracks);
}

TEST(MotionBalance, SoundLogsContradictNothing) {
  const std::vector<MotionFault> found = faults_of_flights({});
  EXPECT_TRUE(found.empty()) << found[0].words;
}

TEST(MotionBalance, EachFaultOfALogIsSaidAloneWithItsSizeAndInterval) {
  const struct {
    double Faults::*fault;
    double size;
    const char* quantity;
    double value;
  } cases[] = {{&Faults::position_lag_s, 0.04, "position_lag_s", 0.04},
               {&Faults::velocity_lag_s, 0.04, "velocity_lag_s", 0.04},
               {&Faults::attitude_lag_s, 0.04, "attitude_lag_s", 0.04},
               {&Faults::velocity_scale, 1.06, "velocity_scale", 1.06},
               {&Faults::heading_rad, 8 * kDegree_rad, "heading_rad", -8 * kDegree_rad},
               {&Faults::tilt_rad, 3 * kDegree_rad, "tilt_rad", 3 * kDegree_rad}};
  for (const auto& one : cases) {
    Faults faults;
    faults.*one.fault = one.size;
    const std::vector<MotionFault> found = faults_of_flights(faults);
    ASSERT_EQ(found.size(), 1U) << one.quantity;
    EXPECT_EQ(found[0].quantity, one.quantity);
    EXPECT_NEAR(found[0].value, one.value, 0.02 * std::abs(one.value) + found[0].half) << found[0].words;
    EXPECT_NE(found[0].words.find("99 % interval"), std::string::npos) << found[0].words;
  }
}

TEST(MotionBalance, NoiseOfVelocitiesOrPositionsIsNoScale) {
  Faults faults;
  faults.velocity_noise_m_s = 2;
  EXPECT_TRUE(faults_of_flights(faults).empty());
  faults = {};
  faults.position_noise_m = 0.1;
  EXPECT_TRUE(faults_of_flights(faults).empty());
}

TEST(MotionBalance, ATiltOfTheFrameDiffersFromATiltOnTheVehicle) {
  Faults faults;
  faults.tilt_rad = 3 * kDegree_rad;
  faults.yaw_rate_rad_s = 0.5;
  const std::vector<MotionFault> of_frame = faults_of_flights(faults);
  ASSERT_EQ(of_frame.size(), 1U);
  EXPECT_NE(of_frame[0].words.find("frame of positions"), std::string::npos) << of_frame[0].words;
  faults.is_tilted_in_body = true;
  const std::vector<MotionFault> of_body = faults_of_flights(faults);
  ASSERT_EQ(of_body.size(), 1U);
  EXPECT_NE(of_body[0].words.find("on the vehicle"), std::string::npos) << of_body[0].words;
}

}  // namespace
}  // namespace swarmcert::identification

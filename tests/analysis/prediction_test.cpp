/// Multi-step prediction: motions that are known in closed form, and what is left out.
#include "analysis/residuals/prediction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/commands/shared/prediction_output.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/file_io.h"
#include "nn/weights/npy.h"

namespace swarmcert::tests {
namespace {

constexpr double kPredictionStep_s = 0.01;
constexpr int kPredictionRecords = 100;
const Eigen::Vector3d kThrown_m_s(1, -2, 3), kSpin_rad_s(0.5, 0, 0);

stability::Model thrown_model() {
  stability::Model model;
  model.kind = "small";
  model.mass_kg = 0.03;
  model.inertia_kg_m2 = {1.6e-5, 1.6e-5, 2.9e-5};
  model.arm_m = 0.046;
  return model;
}

/// A body thrown without thrust that turns about its x axis; the log gives the total thrust and no rotor.
residuals::Track thrown_track() {
  residuals::Track track;
  track.path = "flights/thrown_run1.csv";
  track.has_rates = true;
  track.thrust_source = logs::ThrustSource::kForce;
  for (int i = 0; i < kPredictionRecords; ++i) {
    stability::Instant now;
    const double t = i * kPredictionStep_s;
    now.time_s = t;
    now.v_W_m_s = kThrown_m_s - stability::kGravity_m_s2 * t * Eigen::Vector3d::UnitZ();
    now.p_W_m = kThrown_m_s * t - stability::kGravity_m_s2 / 2 * t * t * Eigen::Vector3d::UnitZ();
    now.R_WB = Eigen::AngleAxisd(kSpin_rad_s.x() * t, Eigen::Vector3d::UnitX()).toRotationMatrix();
    now.omega_B_rad_s = kSpin_rad_s;
    track.instants.push_back(now);
    track.given_thrust.push_back(0);
    track.duty.push_back({});
    track.restarts.push_back(i == 0 ? 1 : 0);
    track.cut.push_back(residuals::Cut::kNone);
  }
  residuals::apply_model(thrown_model(), {{"small"}, {0.03}}, {}, track);
  return track;
}

residuals::FlightPrediction predicted(const residuals::Track& track, bool keeps_states = false) {
  return residuals::predict(thrown_model(), {{"small"}, {0.03}}, track, 0.5, keeps_states);
}

TEST(Prediction, OfAThrownBodyIsItsParabola) {
  const residuals::FlightPrediction flight = predicted(thrown_track());
  ASSERT_EQ(flight.refused, "");
  EXPECT_FALSE(flight.has_torque);
  EXPECT_EQ(flight.starts, 50u);
  EXPECT_LT(flight.errors[residuals::kPositionError].sum(), 1e-10);
  EXPECT_LT(flight.errors[residuals::kVelocityError].sum(), 1e-10);
  // acos of a cosine that is 1 up to round-off.
  EXPECT_LT(flight.errors[residuals::kRotationError].at(50), 1e-7);
  EXPECT_LT(flight.errors[residuals::kRateError].sum(), 1e-12);
}

TEST(Prediction, IsComparedWithAStateThatNothingChanges) {
  const residuals::FlightPrediction flight = predicted(thrown_track());
  const residuals::PredictionErrors& held = flight.held;
  EXPECT_NEAR(held[residuals::kVelocityError].at(50), stability::kGravity_m_s2 * 0.5, 1e-9);
  EXPECT_NEAR(held[residuals::kRotationError].at(10), kSpin_rad_s.x() * 0.1, 1e-7);
  EXPECT_TRUE(std::isnan(held[residuals::kVelocityError].at(51)));
  double sum = 0;
  for (int h = 1; h <= 50; ++h) sum += stability::kGravity_m_s2 * kPredictionStep_s * h;
  EXPECT_NEAR(held[residuals::kVelocityError].sum(), sum, 1e-8);
}

TEST(Prediction, LeavesOutStartsWithContactOrGapWithinTheHorizon) {
  residuals::Track track = thrown_track();
  track.cut[70] = residuals::Cut::kContact;
  // Starts 0 .. 19 end before record 70; 20 .. 49 reach it.
  EXPECT_EQ(predicted(track).starts, 20u);
  track = thrown_track();
  track.restarts[70] = 1;
  EXPECT_EQ(predicted(track).starts, 20u);
}

TEST(Prediction, IsWrittenAsOneFloatArrayWithARowPerRecord) {
  residuals::Track track = thrown_track();
  track.cut[70] = residuals::Cut::kContact;
  const std::string folder = testing::TempDir() + "predictions";
  analysis::write_predictions({predicted(track, true)}, folder, true);
  const files::NpyArray array =
      files::parse_npy(files::read_file(folder + "/thrown_run1.npy"), folder, "thrown_run1.npy");
  EXPECT_TRUE(array.is_float32);
  ASSERT_EQ(array.shape, (std::vector<std::uint64_t>{50, 50, 13}));
  const auto at = [&array](std::size_t start, std::size_t step, std::size_t number) {
    return array.numbers[(start * 50 + step) * 13 + number];
  };
  EXPECT_NEAR(at(3, 9, 0), kThrown_m_s.x() * 13 * kPredictionStep_s, 1e-6);  // x at record 3 + 10
  EXPECT_NEAR(at(3, 9, 6), std::sin(kSpin_rad_s.x() * 13 * kPredictionStep_s / 2), 1e-6);  // qx
  EXPECT_NEAR(at(3, 9, 10), kSpin_rad_s.x(), 1e-6);
  EXPECT_TRUE(std::isnan(at(30, 0, 0)));
}

TEST(Prediction, OfALogWithoutRatesIsRefused) {
  residuals::Track track = thrown_track();
  track.has_rates = false;
  EXPECT_EQ(predicted(track).refused, "the log has no angular rates");
}

}  // namespace
}  // namespace swarmcert::tests

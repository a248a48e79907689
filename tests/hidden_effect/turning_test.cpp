/// Torques that a model lacks, in logs with measured rotor speeds.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

constexpr double kTurnedMass_kg = 0.045, kTurnedG_m_s2 = 9.81, kLever_m = 0.036, kForcePerSquare = 3.7e-8;
constexpr double kTorquePerThrust_m = 0.006;
const Eigen::Vector3d kTurnedInertia_kg_m2(2.6e-5, 2.6e-5, 4.6e-5);

/// The truth about the torques, relative to the model below.
struct TurningTruth {
  Eigen::Vector3d change = Eigen::Vector3d::Zero();  ///< of the torque of the rotors
  double flow_N_s = 0, damping_N_m_s = 0, rotor_inertia_kg_m2 = 0;
  Eigen::Vector4d factors = Eigen::Vector4d::Ones();  ///< of the thrust of each rotor
};

std::string turned_model() {
  std::string rotors;
  const double x[] = {1, -1, -1, 1}, y[] = {-1, -1, 1, 1};
  for (int k = 0; k < 4; ++k)
    rotors += fmt::format("  {{ position_m = [{}, {}, 0.0], spin = \"{}\" }},\n", x[k] * kLever_m,
                          y[k] * kLever_m, k % 2 == 0 ? "ccw" : "cw");
  return fmt::format(
      "schema = \"swarmcert/model/1\"\n[vehicle]\nkind = \"small\"\nmass_kg = {}\n"
      "inertia_kg_m2 = [{}, {}, {}]\ntorque_per_thrust_m = {}\nrotors = [\n{}]\n"
      "[vehicle.thrust_curve]\nforce_N = [0.0, 0.0, {}]\n",
      kTurnedMass_kg, kTurnedInertia_kg_m2[0], kTurnedInertia_kg_m2[1], kTurnedInertia_kg_m2[2],
      kTorquePerThrust_m, rotors, kForcePerSquare * 3000 * 3000);
}

/// Body and rotors, with an attitude loop at 1 kHz that follows random attitudes.
class TurningFlight {
 public:
  TurningFlight(const TurningTruth& truth, unsigned seed, double height_m = 1)
      : truth_(truth), random_(seed) {
    p_.z() = height_m;
    speed_rad_s_.setConstant(std::sqrt(kTurnedMass_kg * kTurnedG_m_s2 / 4 / kForcePerSquare));
  }

  /// Returns the log of `duration_s` at 100 Hz.
  std::string log(double duration_s) {
    std::string text = "t,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz,m1_rads,m2_rads,m3_rads,m4_rads,ax,ay,az\n";
    for (int i = 0; i < duration_s / kStep_s; ++i) {
      if (i % 10 == 0) text += row(i * kStep_s);
      if (i % 400 == 0) wanted_ = Eigen::Vector3d(noise(0.2), noise(0.2), noise(0.5));
      advance();
    }
    return text;
  }

 private:
  static constexpr double kStep_s = 0.001;

  double noise(double sigma) { return std::normal_distribution<double>(0, sigma)(random_); }

  /// The sum of the speeds, counterclockwise positive.
  double spin() const { return Eigen::Vector4d(1, -1, 1, -1).dot(speed_rad_s_); }

  Eigen::Vector4d forces_N() const {
    return kForcePerSquare * truth_.factors.cwiseProduct(speed_rad_s_.cwiseAbs2());
  }

  Eigen::Vector3d specific_force_B() const {
    return Eigen::Vector3d(0, 0, forces_N().sum() / kTurnedMass_kg);
  }

  void advance() {
    const Eigen::Matrix3d R = q_.toRotationMatrix();
    // Leans back towards the start; the yaw is free.
    const auto towards = [](double p_m, double v_m_s) {
      return std::clamp(0.1 * p_m + 0.2 * v_m_s, -0.4, 0.4);
    };
    const Eigen::Vector3d home(towards(p_.y(), v_.y()), -towards(p_.x(), v_.x()), 0);
    const Eigen::Vector3d lean = Eigen::Vector3d::UnitZ().cross(R.col(2));
    const Eigen::Vector3d error = R.transpose() * (home + wanted_ - lean);
    const Eigen::Vector3d torque = kTurnedInertia_kg_m2.cwiseProduct(
        Eigen::Vector3d(150 * error.x(), 150 * error.y(), 10 * wanted_.z()) - 25 * omega_);
    const double thrust_N =
        kTurnedMass_kg * (kTurnedG_m_s2 - 2 * (p_.z() - 1) - 2 * v_.z()) / std::max(R(2, 2), 0.5);
    const Eigen::Vector3d share(torque.x() / kLever_m, torque.y() / kLever_m,
                                torque.z() / kTorquePerThrust_m);
    const double signs[4][3] = {{-1, -1, -1}, {-1, 1, 1}, {1, 1, -1}, {1, -1, 1}};
    Eigen::Vector3d rotors = Eigen::Vector3d::Zero();
    const double spin_rad_s = spin();
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d sign(signs[k]);
      const double force_N = std::max((thrust_N + sign.dot(share)) / 4, 0.01);
      speed_rad_s_[k] += kStep_s / 0.03 * (std::sqrt(force_N / kForcePerSquare) - speed_rad_s_[k]);
      rotors += forces_N()[k] * sign.cwiseProduct(Eigen::Vector3d(kLever_m, kLever_m, kTorquePerThrust_m));
    }
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    rotors -= truth_.rotor_inertia_kg_m2 * ((spin() - spin_rad_s) / kStep_s * up + omega_.cross(spin() * up));
    const Eigen::Vector3d v_B = R.transpose() * v_;
    const Eigen::Vector3d sum = rotors + truth_.change.cwiseProduct(rotors) +
                                truth_.flow_N_s * Eigen::Vector3d(v_B.y(), -v_B.x(), 0) -
                                truth_.damping_N_m_s * Eigen::Vector3d(omega_.x(), omega_.y(), 0);
    const Eigen::Vector3d momentum = kTurnedInertia_kg_m2.cwiseProduct(omega_);
    v_ += kStep_s * (R * specific_force_B() - kTurnedG_m_s2 * Eigen::Vector3d::UnitZ());
    p_ += kStep_s * v_;
    omega_ += kStep_s * (sum - omega_.cross(momentum)).cwiseQuotient(kTurnedInertia_kg_m2);
    const double angle = omega_.norm() * kStep_s;
    if (angle > 0) q_ = (q_ * Eigen::AngleAxisd(angle, omega_.normalized())).normalized();
  }

  std::string row(double time_s) {
    const Eigen::Vector3d a = specific_force_B();
    std::string text = fmt::format("{:.4f},{:.6f},{:.6f},{:.6f},{:.7f},{:.7f},{:.7f},{:.7f}", time_s, p_.x(),
                                   p_.y(), p_.z(), q_.x(), q_.y(), q_.z(), q_.w());
    for (int k = 0; k < 3; ++k) text += fmt::format(",{:.6f}", v_[k] + noise(0.003));
    for (int k = 0; k < 3; ++k) text += fmt::format(",{:.5f}", omega_[k] + noise(0.02));
    for (int k = 0; k < 4; ++k) text += fmt::format(",{:.2f}", speed_rad_s_[k]);
    for (int k = 0; k < 3; ++k) text += fmt::format(",{:.5f}", a[k] + noise(0.1));
    return text + "\n";
  }

  const TurningTruth truth_;
  std::mt19937 random_;
  Eigen::Vector3d p_ = Eigen::Vector3d::UnitZ(), v_ = Eigen::Vector3d::Zero(), wanted_ = v_, omega_ = v_;
  Eigen::Quaterniond q_ = Eigen::Quaterniond::Identity();
  Eigen::Vector4d speed_rad_s_;
};

/// The effects of `list` that turn a vehicle.
std::set<std::string> turning_of(const files::Json& list, const char* key) {
  const std::set<std::string> turning = {"torque_ratio", "rate_damping", "flow_torque", "rotor_momentum"};
  std::set<std::string> names;
  for (const files::Json& one : list)
    if (turning.count(one[key]) > 0) names.insert(one[key].get<std::string>());
  return names;
}

/// Returns the result of `study` on three flights of 25 s. `diagnose` names the same effects that turn the vehicle.
files::Json study_of(const TurningTruth& truth) {
  const ScratchFolder folder;
  for (unsigned run = 1; run <= 3; ++run)
    write_text(folder / fmt::format("turns_run{}.csv", run), TurningFlight(truth, run).log(25));
  write_text(folder / "model.toml", turned_model());
  const Outcome outcome = run_shell(
      "swarmcert study model.toml turns_run1.csv turns_run2.csv turns_run3.csv -q -o page --json result.json",
      folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  const Outcome diagnosed = run_shell(
      "swarmcert diagnose model.toml turns_run1.csv turns_run2.csv turns_run3.csv -q --json diagnosed.json",
      folder.path());
  EXPECT_EQ(diagnosed.exit_code, 0) << diagnosed.output;
  const files::Json result = files::read_json(folder / "result.json", "swarmcert/study/1");
  const files::Json ranking = files::read_json(folder / "diagnosed.json", "swarmcert/diagnose/1")["ranking"];
  EXPECT_EQ(turning_of(ranking, "effect"), turning_of(result["causes"], "name"));
  return result;
}

TEST(Turning, AWeakRotorHasItsFactorFromMeasuredSpeeds) {
  TurningTruth truth;
  truth.factors[2] = 0.85;
  const ScratchFolder folder;
  for (unsigned run = 1; run <= 5; ++run)
    write_text(folder / fmt::format("weak_run{}.csv", run), TurningFlight(truth, run, 0.4).log(25));
  write_text(folder / "model.toml", turned_model());
  const Outcome outcome = run_shell(
      "swarmcert add rotor_thrust --model model.toml weak_run*.csv -q -o new.toml --json result.json",
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json result = files::read_json(folder / "result.json", "swarmcert/add/1");
  ASSERT_EQ(result["effects"].size(), 1u) << result["ladder"].dump(1);
  const files::Json& factors = result["effects"][0]["parameters"];
  for (Eigen::Index k = 0; k < 4; ++k) {
    // These flights turn all the time: the torques cancel on average only.
    EXPECT_NEAR(factors[fmt::format("rotor_{}", k + 1)]["value"].get<double>(), truth.factors[k], 0.05) << k;
  }
}

const files::Json* cause_named(const files::Json& result, const std::string& name) {
  for (const files::Json& cause : result["causes"]) {
    if (cause["name"] == name) return &cause;
  }
  return nullptr;
}

double rate_error(const files::Json& result, const char* when) {
  return result[when]["prediction"]["rate_rad_s"]["sum"].get<double>();
}

TEST(Turning, FlowTorqueAndInertiaAreFoundTogetherWithTheirValues) {
  TurningTruth truth;
  truth.change = {-0.3, -0.3, 0};
  truth.flow_N_s = 5e-4;
  const files::Json result = study_of(truth);
  for (const char* const name : {"torque_ratio", "flow_torque"})
    ASSERT_NE(cause_named(result, name), nullptr) << result["causes"].dump(1);
  const files::Json& flow = (*cause_named(result, "flow_torque"))["parameters"]["moment_N_s"];
  EXPECT_NEAR(flow["value"].get<double>(), truth.flow_N_s, 0.06 * truth.flow_N_s);
  const files::Json& ratio = (*cause_named(result, "torque_ratio"))["parameters"]["change_x"];
  EXPECT_NEAR(ratio["value"].get<double>(), truth.change.x(), 0.1);
  EXPECT_LT(rate_error(result, "after"), 0.3 * rate_error(result, "before"));
}

TEST(Turning, MomentumOfTheRotorsIsFoundInTheYaw) {
  TurningTruth truth;
  truth.rotor_inertia_kg_m2 = 5e-8;
  const files::Json result = study_of(truth);
  ASSERT_NE(cause_named(result, "rotor_momentum"), nullptr) << result["causes"].dump(1);
  const files::Json& inertia = (*cause_named(result, "rotor_momentum"))["parameters"]["inertia_kg_m2"];
  EXPECT_NEAR(inertia["value"].get<double>(), 5e-8, 1e-8);
}

TEST(Turning, WithNothingHiddenNothingIsClaimed) {
  const files::Json result = study_of({});
  EXPECT_TRUE(result["causes"].empty()) << result["causes"].dump(1);
}

}  // namespace
}  // namespace swarmcert::tests

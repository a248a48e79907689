// What is stated about the loop that flies holds for the nonlinear vehicle: sampling, clamp, lags, delay and limits of
// the thrust, under the worst inputs that were declared.
#include "stability/bounds/flown_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nn/base/random.h"
#include "stability/bounds/around_attitude.h"
#include "stability/bounds/disturbance_source.h"
#include "stability/bounds/saturation.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/simulation/sampled_flight.h"
#include "stability/sweep/grid.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

Gains gains_of(const std::string& position, const std::string& rest = "") {
  return parse_gains("schema = \"swarmcert/gains/1\"\n[position]\n" + position + "\n" + rest, "gains.toml");
}

FlownLoop shipped(const std::string& name) {
  return load_flown_loop(tests::source_path("controller/gains/" + name + ".toml"),
                         tests::source_path("stability/models/crazyflie-small.toml"));
}

DisturbanceSource amplitude_of(double amplitude_N) {
  DisturbanceSource source;
  source.kind = "declared";
  for (Disturbance& d : source.axis) d.amplitude_N = amplitude_N;
  return source;
}

DisturbanceSource rate_of(double rate_N_s) {
  DisturbanceSource source;
  source.kind = "declared";
  for (Disturbance& d : source.axis) d.rate_N_s = rate_N_s;
  source.rate_norm_N_s = rate_N_s;
  return source;
}

/// The vehicle as a point: the law of the firmware in its period, clamp, delay, limits of the thrust along the
/// commanded direction, lags. Integrated by itself, without the library's matrices.
class PointVehicle {
 public:
  explicit PointVehicle(const FlownLoop& loop) : loop_(loop), law_(loop.law()) {
    law_.Ki /= loop.integral_share();
    late_.assign(static_cast<std::size_t>(std::lround(loop.gains.delay_s / step_s())) + 1,
                 Eigen::Vector3d::Zero());
  }

  double period_s() const { return 1 / loop_.gains.rate_hz; }
  double step_s() const { return period_s() / kSteps; }
  bool has_saturated() const { return has_saturated_; }
  const Eigen::Vector3d& error_m() const { return e_; }
  /// Returns the largest |e_i| during the period, under a force that is held.
  Eigen::Vector3d fly_period(const Eigen::Vector3d& force_N) {
    for (int i = 0; i < 3; ++i) {
      const double limit = loop_.integrator_limit_m_s(i);
      integral_[i] = std::clamp(integral_[i] + loop_.gains.integrator_step_s * e_[i], -limit, limit);
    }
    const double m = loop_.plant.mass_kg;
    const Eigen::Vector3d weight_N(0, 0, m * kGravity_m_s2);
    Eigen::Vector3d wanted_N = weight_N - m * (law_.Kp * e_ + law_.Kd * v_ + law_.Ki * integral_);
    const Interval range = loop_.thrust_range_N();
    const double size_N = wanted_N.norm(), given_N = std::clamp(size_N, range.lower, range.upper);
    has_saturated_ = has_saturated_ || given_N != size_N;
    wanted_N *= given_N / size_N;
    Eigen::Vector3d most = e_.cwiseAbs();
    for (int k = 0; k < kSteps; ++k) {
      late_[count_ % late_.size()] = (wanted_N - weight_N) / m;
      const Eigen::Vector3d command = late_[(count_ + 1) % late_.size()];
      ++count_;
      step(command, force_N / m);
      most = most.cwiseMax(e_.cwiseAbs());
    }
    return most;
  }

 private:
  static constexpr int kSteps = 20, kParts = 2;

  /// Lags exactly for the held input, then the motion by Simpson's rule.
  void step(const Eigen::Vector3d& command, const Eigen::Vector3d& push) {
    const double h = step_s() / kParts;
    for (int part = 0; part < kParts; ++part) {
      Eigen::Vector3d a[3];
      a[0] = applied(command) + push;
      lag(command, h / 2);
      a[1] = applied(command) + push;
      lag(command, h / 2);
      a[2] = applied(command) + push;
      e_ += h * v_ + h * h * (a[0] / 6 + a[1] / 3);
      v_ += h * (a[0] + 4 * a[1] + a[2]) / 6;
    }
  }
  void lag(const Eigen::Vector3d& command, double h) {
    const double tau = loop_.gains.motor_lag_s, turn = loop_.gains.attitude_lag_s;
    const Eigen::Vector3d before = motor_;
    if (tau > 0) motor_ += (command - motor_) * (1 - std::exp(-h / tau));
    const Eigen::Vector3d input = tau > 0 ? Eigen::Vector3d((before + motor_) / 2) : command;
    if (turn > 0) direction_ += (input - direction_) * (1 - std::exp(-h / turn));
  }
  Eigen::Vector3d applied(const Eigen::Vector3d& command) const {
    Eigen::Vector3d result = loop_.gains.motor_lag_s > 0 ? motor_ : command;
    if (loop_.gains.attitude_lag_s > 0) result.head<2>() = direction_.head<2>();
    return result;
  }

  FlownLoop loop_;
  PidMatrices law_;
  Eigen::Vector3d e_ = Eigen::Vector3d::Zero(), v_ = e_, integral_ = e_, motor_ = e_, direction_ = e_;
  std::vector<Eigen::Vector3d> late_;
  std::size_t count_ = 0;
  bool has_saturated_ = false;
};

/// The loop without limits of the thrust and clamps, whose responses the worst inputs are made of.
FlownLoop without_limits(FlownLoop loop) {
  loop.plant.largest_thrust_N = 1e9;
  loop.plant.least_thrust_N = -1e9;
  loop.gains.integrator_limit_m_s.fill(std::numeric_limits<double>::infinity());
  return loop;
}

TEST(FlownLoop, WorstForcesOfAllAxesTogetherSaturateTheShippedLoopAtTheAmplitudeOfATwoVehicleSwap) {
  const FlownLoop loop = shipped("crazyflie-small");
  const Saturation found = saturation(loop, amplitude_of(0.097), {});
  EXPECT_EQ(found.verdict, Saturation::Verdict::kRefuted) << found.why;
  EXPECT_GE(found.most_N, 1.2);
  EXPECT_NEAR(found.available_N.upper, 0.843, 1e-3);
  const Saturation demand = thrust_demand(loop, amplitude_of(0.097), {});
  EXPECT_EQ(demand.verdict, Saturation::Verdict::kUndecided) << "no counterexample is looked for";
  EXPECT_EQ(demand.margin_N(), found.margin_N());
  // Its horizontal axes alone command more than the rotors give.
  DisturbanceSource sideways = amplitude_of(0);
  sideways.axis[0].amplitude_N = sideways.axis[1].amplitude_N = 0.097;
  EXPECT_GT(saturation(loop, sideways, {}).most_N, found.available_N.upper);
  EXPECT_TRUE(saturation(loop, amplitude_of(0.01), {}).is_proved());
  const TrackingReport report = tracking_bounds(loop, amplitude_of(0.097), {});
  const auto is_thrust = [](const Assumption& a) {
    return a.name == "no saturation of the collective thrust";
  };
  const auto thrust = std::find_if(report.assumptions.begin(), report.assumptions.end(), is_thrust);
  ASSERT_NE(thrust, report.assumptions.end());
  EXPECT_EQ(thrust->status, "refuted");
}

TEST(FlownLoop, TheTheoremDoesNotApplyToGainsThatDivergeAtTheirRate) {
  const FlownLoop slow = {gains_of("Lambda = 6\nK = 0.408\nrate_hz = 10"), {0.034}};
  EXPECT_NEAR(slow.spectral_radius(), 1.66, 0.01);
  EXPECT_EQ(slow.is_stable(), false);
  const Theorem theorem = check_theorem(slow, {});
  EXPECT_FALSE(theorem.applies);
  ASSERT_EQ(theorem.why_not.size(), 1u);
  EXPECT_NE(theorem.why_not[0].find("diverges"), std::string::npos);
  EXPECT_TRUE(check_theorem({gains_of("Lambda = 6\nK = 0.408\nrate_hz = 500"), {0.034}}, {}).applies);
  // Coupled axes: the same, judged on all axes together.
  const std::string coupled = "Lambda = [[6, 0.1, 0], [0.1, 6, 0], [0, 0, 6]]\nK = 0.408\n";
  EXPECT_FALSE(check_theorem({gains_of(coupled + "rate_hz = 10"), {0.034}}, {}).applies);
  EXPECT_TRUE(check_theorem({gains_of(coupled + "rate_hz = 500"), {0.034}}, {}).applies);
}

TEST(FlownLoop, TheBallOfTheLoopThatFliesIsThatOfItsSamples) {
  const FlownLoop loop = {gains_of("Lambda = 13\nK = 0.442\nrate_hz = 20"), {0.034}};
  const Theorem theorem = check_theorem(loop, {});
  ASSERT_TRUE(theorem.applies);
  const double of_force = sampled_norms(*loop.sampled(2), Channel::kForce, Instants::kAll).rate;
  EXPECT_NEAR(of_force / theorem.ball_per_rate(), 1.10, 0.015);
  EXPECT_GE(flown_ball_per_rate(loop, theorem).value(), of_force);
}

TEST(FlownLoop, ARateAloneLeavesNoUnconditionalBall) {
  const FlownLoop loop = shipped("composite");
  DisturbanceSource source = rate_of(0.3);
  EXPECT_EQ(saturation(loop, source, {}).verdict, Saturation::Verdict::kRefuted);
  for (Disturbance& d : source.axis) d.amplitude_N = 0.1;
  EXPECT_TRUE(saturation(loop, source, {}).is_proved());
}

TEST(FlownLoop, ASweepPrintsTheSampledLoopOfEachCellAndRejectsWhatDiverges) {
  Grid grid;
  grid.gains = load_gains(tests::source_path("controller/gains/composite.toml"));
  grid.model = tests::small_vehicle();
  grid.axes = {{"rate_hz", {100, 500}}};
  grid.compute = {"rate", "spectral_radius"};
  for (long k = 0; k < 2; ++k) {
    const Cell cell = compute_cell(grid, k);
    EXPECT_EQ(cell.infeasible, "");
    EXPECT_NEAR(cell.values[0], 0.45955882352941174,
                1e-6);  // 1/(m Ki): the integrator's step follows the rate
    EXPECT_LT(cell.values[1], 1);
  }
  grid.gains = load_gains(tests::source_path("controller/gains/crazyflie-small.toml"));
  grid.axes = {{"rate_hz", {10, 100}}};
  grid.compute = {"impulse", "error_m"};
  grid.disturbance.impulse_N_s = 0.0202;
  for (const auto& [k, rate_hz] : {std::pair(0L, 10.0), std::pair(1L, 100.0)}) {
    FlownLoop loop = shipped("crazyflie-small");
    loop.gains.rate_hz = rate_hz;
    const SampledLoop z = *loop.sampled(2);
    const Cell cell = compute_cell(grid, k);
    ASSERT_EQ(cell.infeasible, "");
    EXPECT_EQ(cell.values[0], sampled_norms(z, Channel::kForce, Instants::kAll).impulse);
  }
  // Converges although the loop with the Ki as written does not.
  grid.axes = {{"Ki", {60}}};
  grid.compute = {"spectral_radius"};
  EXPECT_EQ(compute_cell(grid, 0).infeasible, "");
}

/// The vehicle with its attitude, rotors and mixing, flown by the flight code.
class FullVehicle {
 public:
  explicit FullVehicle(const FlownLoop& loop) : steps_(static_cast<int>(500 / loop.gains.rate_hz)) {
    swarm_.assume_lag(loop.gains.motor_lag_s, 0);
    SampledFlightOptions options;
    options.flies_float = false;
    options.battery_start_V = kFullBattery_V;
    options.battery_drop_V_s = 0;
    options.ground_m = -1e3;
    flight_.emplace(swarm_, loop.gains, *task_, options);
  }

  bool has_saturated() const { return has_saturated_; }
  Eigen::Vector3d error_m() const {
    return Eigen::Map<const Eigen::Vector3d>(flight_->state()) - task_->at(0, flight_->time_s()).p_W_m;
  }
  Eigen::Vector3d fly_period(const Eigen::Vector3d& force_N) {
    Eigen::Vector3d most = error_m().cwiseAbs();
    for (int k = 0; k < steps_; ++k) {
      flight_->input(0).disturbance_W_N = force_N;
      flight_->step();
      has_saturated_ = has_saturated_ || flight_->is_saturated(0);
      most = most.cwiseMax(error_m().cwiseAbs());
    }
    return most;
  }

 private:
  Swarm swarm_{tests::small_vehicle(), 1};
  std::unique_ptr<Task> task_ = make_task("hover", {1, 60, 0});
  std::optional<SampledFlight> flight_;
  int steps_;
  bool has_saturated_ = false;
};

/// What attacks found: totals compared, exceeded, attained to 80 %.
struct Attacks {
  int runs = 0, exceeded = 0, close = 0, excluded = 0;
  double closest = 0;

  void add(double error_m, double total_m) {
    ++runs;
    exceeded += error_m > total_m * (1 + 1e-6);
    close += error_m > 0.8 * total_m;
    closest = std::max(closest, error_m / total_m);
  }
};

constexpr double kAttack_s = 15;

/// Flies the force of each axis that drives its error farthest, held over each period: the sign of the response to a
/// pulse, which the linear loop shows.
/// @param beyond_linear_N force that the linear loop leaves out.
template <class Vehicle>
void attack(const FlownLoop& loop, const FlownLoop& linear_loop, double amplitude_N, double beyond_linear_N,
            Attacks& attacks) {
  const int periods = static_cast<int>(kAttack_s * loop.gains.rate_hz);
  std::vector<Eigen::Vector3d> kernel;
  Vehicle linear(linear_loop), shifted(linear_loop);
  for (int k = 0; k < periods; ++k) {
    const Eigen::Vector3d push = Eigen::Vector3d::Constant(k == 0 ? 1e-6 : 0);
    linear.fly_period(push + Eigen::Vector3d::Constant(1e-3));
    shifted.fly_period(Eigen::Vector3d::Constant(1e-3));
    kernel.push_back(linear.error_m() - shifted.error_m());
  }
  Vehicle vehicle(loop);
  Eigen::Vector3d most = Eigen::Vector3d::Zero();
  for (int k = 0; k < periods; ++k) {
    const Eigen::Vector3d& at = kernel[static_cast<std::size_t>(periods - 1 - k)];
    most = most.cwiseMax(vehicle.fly_period(amplitude_N * at.cwiseSign()));
  }
  EXPECT_FALSE(vehicle.has_saturated());
  for (int axis = 0; axis < 3; ++axis) {
    const ExactGains gains = flown_gains(loop, axis, Channel::kForce);
    const double total_m = axis_bounds(loop, gains, amplitude_of(amplitude_N), {}).total_m();
    attacks.add(most[axis], total_m + gains.all_times.amplitude * beyond_linear_N);
  }
}

/// Reports the attacks; a third of the totals must be attained to 80 %, so that not exceeding them says something.
void expect_none_exceeded(const Attacks& attacks) {
  testing::Test::RecordProperty("runs", attacks.runs);
  testing::Test::RecordProperty("attained_80_percent", attacks.close);
  EXPECT_GE(attacks.runs, 30);
  EXPECT_EQ(attacks.exceeded, 0) << "closest " << attacks.closest;
  EXPECT_GE(3 * attacks.close, attacks.runs)
      << attacks.runs << " runs, " << attacks.excluded << " without a proof";
}

TEST(FlownLoop, NoAttackOnTheNonlinearVehicleExceedsATotalWhoseConditionIsProved) {
  files::Random random(51);
  Attacks attacks;
  for (int trial = 0; trial < 40; ++trial) {
    const double Kp = 8 + 14 * random.uniform(), Kd = 4 + 6 * random.uniform(), Ki = 1 + 6 * random.uniform();
    const double rate_hz = random.uniform() < 0.5 ? 100 : 50;
    std::string text = "Kp = " + std::to_string(Kp) + "\nKd = " + std::to_string(Kd) +
                       "\nKi = " + std::to_string(Ki) + "\nrate_hz = " + std::to_string(rate_hz) + "\n";
    if (random.uniform() < 0.5) text += "integrator_limit = 0.05\n";
    std::string lag = "[lag]\nmotor_s = " + std::to_string(0.02 + 0.04 * random.uniform()) + "\n";
    if (random.uniform() < 0.3) lag += "attitude_s = 0.03\n";
    if (random.uniform() < 0.3) lag += "delay_s = 0.01\n";
    const FlownLoop loop = flown_loop(gains_of(text, lag), tests::small_vehicle());
    if (loop.is_stable() != true) continue;
    const double amplitude_N = 0.002 + 0.03 * random.uniform();
    if (saturation(loop, amplitude_of(amplitude_N), {}).is_proved()) {
      attack<PointVehicle>(loop, without_limits(loop), amplitude_N, 0, attacks);
    } else {
      ++attacks.excluded;
    }
  }
  expect_none_exceeded(attacks);
}

TEST(FlownLoop, NorDoesOneOnTheVehicleWithItsAttitudeLoopInPlaceOfALagThatContainsIt) {
  files::Random random(52);
  Attacks attacks;
  // Lee's law with the gains of the flight code about the horizontal axes.
  const std::string attitude = "[attitude]\nlaw = \"lee\"\nKR = 0.007\nKw = 0.00115\nKI = 0\n";
  for (int trial = 0; trial < 20; ++trial) {
    const double Kp = 3 + 5 * random.uniform(), Kd = 3 + 3 * random.uniform(), Ki = 1 + 2 * random.uniform();
    const std::string text = "Kp = " + std::to_string(Kp) + "\nKd = " + std::to_string(Kd) +
                             "\nKi = " + std::to_string(Ki) + "\nrate_hz = 100\n";
    const std::string lag = "[lag]\nmotor_s = " + std::to_string(0.01 + 0.03 * random.uniform()) + "\n";
    FlownLoop loop = flown_loop(gains_of(text, attitude + lag), tests::small_vehicle());
    const std::optional<double> lag_s = lag_that_contains_attitude_s(loop);
    ASSERT_TRUE(lag_s);
    loop.gains.attitude_lag_s = *lag_s;
    if (loop.is_stable() != true) continue;
    const double amplitude_N = 4e-4 + 2.6e-3 * random.uniform();  // tilts of a few degrees
    const Saturation thrust = saturation(loop, amplitude_of(amplitude_N), {});
    if (thrust.is_proved()) {
      attack<FullVehicle>(loop, loop, amplitude_N, thrust.beyond_linear_N(), attacks);
    } else {
      ++attacks.excluded;
    }
  }
  expect_none_exceeded(attacks);
}

TEST(FlownLoop, ALagShorterThanTheDeclaredAttitudeLoopIsRefutedAndADivergingLoopDoesNotFly) {
  const auto loop_with = [](const std::string& attitude, const std::string& lag) {
    return flown_loop(gains_of("Kp = 6\nKd = 5\nKi = 1\nrate_hz = 100\n", attitude + "[lag]\n" + lag),
                      tests::small_vehicle());
  };
  const auto status = [](const FlownLoop& loop) {
    const TrackingReport report = tracking_bounds(loop, amplitude_of(0.01), {});
    for (const Assumption& one : report.assumptions)
      if (one.name.find("thrust's direction") != std::string::npos) return one.status;
    return std::string("not stated");
  };
  EXPECT_EQ(status(loop_with("", "motor_s = 0.03\n")), "assumed");  // states that x and y tilt at once
  const std::string slow = "[attitude]\nKR = 0.002\nKw = 0.0006\nKI = 0\n";
  const FlownLoop at_once = loop_with(slow, "motor_s = 0.01\n");
  EXPECT_EQ(status(at_once), "refuted");
  EXPECT_EQ(at_once.is_stable(), true);
  const std::optional<double> enough_s = lag_that_contains_attitude_s(at_once);
  ASSERT_TRUE(enough_s);
  EXPECT_EQ(
      status(loop_with(slow, "motor_s = 0.01\nattitude_s = " + std::to_string(*enough_s * 1.01) + "\n")),
      "assumed");
  EXPECT_EQ(loop_with("[attitude]\nKR = 0.002\nKw = 0.00002\nKI = 0\n", "motor_s = 0.06\n").is_stable(),
            false);
}

}  // namespace
}  // namespace swarmcert::stability

// What is stated about the loop that flies holds for the nonlinear vehicle: sampling, clamp, lags, delay and limits of
// the thrust, under the worst inputs that were declared.
#include "stability/bounds/flown_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
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

/// The same class on every axis.
DisturbanceSource declared(const Disturbance& known) {
  DisturbanceSource source;
  source.kind = "declared";
  for (Disturbance& d : source.axis) d = known;
  return source;
}

DisturbanceSource amplitude_of(double amplitude_N) {
  Disturbance known;
  known.amplitude_N = amplitude_N;
  return declared(known);
}

DisturbanceSource rate_of(double rate_N_s) {
  Disturbance known;
  known.rate_N_s = rate_N_s;
  DisturbanceSource source = declared(known);
  source.rate_norm_N_s = rate_N_s;
  return source;
}

/// What acts on a vehicle during one period: a force that changes linearly, and an error of the commanded force.
struct Push {
  Eigen::Vector3d from_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d command_N = Eigen::Vector3d::Zero();
};

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
  /// Returns the largest |e_i| during the period.
  Eigen::Vector3d fly_period(const Push& push) {
    for (int i = 0; i < 3; ++i) {
      const double limit = loop_.integrator_limit_m_s(i);
      integral_[i] = std::clamp(integral_[i] + loop_.gains.integrator_step_s * e_[i], -limit, limit);
    }
    const double m = loop_.plant.mass_kg;
    const Eigen::Vector3d weight_N(0, 0, m * kGravity_m_s2);
    Eigen::Vector3d wanted_N =
        weight_N + push.command_N - m * (law_.Kp * e_ + law_.Kd * v_ + law_.Ki * integral_);
    const Interval range = loop_.thrust_range_N();
    const double size_N = wanted_N.norm(), given_N = std::clamp(size_N, range.lower, range.upper);
    has_saturated_ = has_saturated_ || given_N != size_N;
    wanted_N *= given_N / size_N;
    Eigen::Vector3d most = e_.cwiseAbs();
    for (int k = 0; k < kSteps; ++k) {
      late_[count_ % late_.size()] = (wanted_N - weight_N) / m;
      const Eigen::Vector3d command = late_[(count_ + 1) % late_.size()];
      ++count_;
      const Eigen::Vector3d slope_N = (push.to_N - push.from_N) / kSteps;
      step(command, (push.from_N + k * slope_N) / m, slope_N / m);
      most = most.cwiseMax(e_.cwiseAbs());
    }
    return most;
  }

 private:
  static constexpr int kSteps = 20, kParts = 2;

  /// Lags exactly for the held input, then the motion by Simpson's rule.
  /// @param push, change acceleration by the force at the start, and what it changes by
  void step(const Eigen::Vector3d& command, const Eigen::Vector3d& push, const Eigen::Vector3d& change) {
    const double h = step_s() / kParts;
    for (int part = 0; part < kParts; ++part) {
      Eigen::Vector3d a[3];
      for (int i = 0; i < 3; ++i) {
        if (i > 0) lag(command, h / 2);
        a[i] = applied(command) + push + (part + 0.5 * i) / kParts * change;
      }
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
  Eigen::Vector3d fly_period(const Push& push) {
    Eigen::Vector3d most = error_m().cwiseAbs();
    for (int k = 0; k < steps_; ++k) {
      flight_->input(0).disturbance_W_N = push.from_N + (k + 0.5) / steps_ * (push.to_N - push.from_N);
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

/// What attacks found: totals compared and exceeded; of those whose linear loop is the one that flies, how many were
/// attained to 80 %.
struct Attacks {
  int runs = 0, exceeded = 0, same_loop = 0, close = 0, excluded = 0;
  double closest = 0;

  void add(double error_m, double total_m, bool is_same_loop) {
    ++runs;
    exceeded += error_m > total_m * (1 + 1e-6);
    closest = std::max(closest, error_m / total_m);
    same_loop += is_same_loop;
    close += is_same_loop && error_m > 0.8 * total_m;
  }
};

/// A force of one axis, N, at the start and the end of each period.
using Course = std::vector<std::pair<double, double>>;

/// Returns courses of a class that drive the error far at the end of the last period.
/// @param pulse the response of the error to a force during one period, by the periods since.
std::vector<Course> worst_courses(const Disturbance& known, const std::vector<double>& pulse,
                                  double period_s) {
  const std::size_t n = pulse.size();
  const auto sign_of = [](double x) { return x < 0 ? -1.0 : 1.0; };
  const auto largest_from = [n](const std::vector<double>& response, std::size_t first) {
    std::size_t at = first;
    for (std::size_t i = first; i < n; ++i)
      if (std::abs(response[i]) > std::abs(response[at])) at = i;
    return at;
  };
  // Each from its first period to the last, which is 0 periods ago.
  const auto course_of = [n](const auto& next_of) {
    Course course;
    for (std::size_t ago = n; ago-- > 0;)
      course.push_back(next_of(ago, course.empty() ? 0 : course.back().second));
    return course;
  };
  const auto held = [&](const auto& force_of) {
    return course_of([&](std::size_t ago, double) { return std::pair(force_of(ago), force_of(ago)); });
  };
  std::vector<double> edge(n);
  std::partial_sum(pulse.begin(), pulse.end(), edge.begin());
  if (std::isfinite(known.variation_N)) {
    const std::size_t at = largest_from(edge, 0);
    return {held([&](std::size_t ago) { return ago <= at ? known.variation_N : 0; })};
  }
  if (std::isfinite(known.impulse_N_s)) {
    std::vector<double> force(n, 0);
    const auto apart = static_cast<std::size_t>(std::ceil(known.pass_period_s / period_s));
    for (std::size_t at = largest_from(pulse, 0); at < n; at = largest_from(pulse, std::min(n, at + apart)))
      force[at] = known.impulse_N_s / period_s * sign_of(pulse[at]);
    return {held([&](std::size_t ago) { return force[ago]; })};
  }
  const double A = known.amplitude_N, step = known.rate_N_s * period_s;
  if (std::isinf(step)) return {held([&](std::size_t ago) { return A * sign_of(pulse[ago]); })};
  return {course_of([&](std::size_t ago, double f) {  // ramps to a hold
            return std::pair(f, std::clamp(f + step * sign_of(edge[ago]), -A, A));
          }),
          course_of([&](std::size_t ago, double f) {  // the worst amplitude as far as the rate allows
            return std::pair(f, f + std::clamp(A * sign_of(pulse[ago]) - f, -step, step));
          })};
}

/// Flies the worst courses of the classes that `loop` is declared to be under, which its linear responses show.
template <class Vehicle>
class Attacker {
 public:
  /// @param linear_loop without what is not linear.
  Attacker(const FlownLoop& loop, const FlownLoop& linear_loop) : loop_(loop), linear_loop_(linear_loop) {}

  /// @param beyond_linear_N force that the linear loop leaves out.
  void attack(const Disturbance& known, Channel channel, double beyond_linear_N, Attacks& attacks) {
    const double period_s = 1 / loop_.gains.rate_hz;
    std::vector<Course> courses[3];
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> pulse;
      for (const Eigen::Vector3d& e : pulses(channel)) pulse.push_back(e[axis]);
      courses[axis] = worst_courses(known, pulse, period_s);
    }
    Eigen::Vector3d most = Eigen::Vector3d::Zero();
    for (std::size_t which = 0; which < courses[0].size(); ++which) {
      Vehicle vehicle(loop_);
      for (std::size_t k = 0; k < courses[0][which].size(); ++k) {
        Push push;
        for (int axis = 0; axis < 3; ++axis) {
          const auto& [from_N, to_N] = courses[axis][which][k];
          (channel == Channel::kForce ? push.from_N : push.command_N)[axis] = from_N;
          if (channel == Channel::kForce) push.to_N[axis] = to_N;
        }
        most = most.cwiseMax(vehicle.fly_period(push));
      }
      EXPECT_FALSE(vehicle.has_saturated());
    }
    for (int axis = 0; axis < 3; ++axis) {
      const ExactGains gains = flown_gains(loop_, axis, channel);
      const double total_m = axis_bounds(loop_, gains, declared(known), {}).total_m();
      // A lag that contains the attitude loop is a slower loop than the one that flies.
      const bool is_same_loop = axis == 2 || !loop_.gains.attitude;
      attacks.add(most[axis], total_m + gains.all_times.amplitude * beyond_linear_N, is_same_loop);
    }
  }

 private:
  /// The response to a pulse in the first period, by the periods since.
  const std::vector<Eigen::Vector3d>& pulses(Channel channel) {
    constexpr double kAttack_s = 15, kPulse_N = 1e-6;
    std::vector<Eigen::Vector3d>& response = pulses_[channel == Channel::kForce ? 0 : 1];
    if (!response.empty()) return response;
    const Push nothing = {Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1e-3)};
    Push pulse = nothing;
    if (channel == Channel::kForce) pulse.from_N.array() += kPulse_N, pulse.to_N.array() += kPulse_N;
    if (channel == Channel::kCommand) pulse.command_N.array() += kPulse_N;
    Vehicle pushed(linear_loop_), other(linear_loop_);
    for (int k = 0; k < kAttack_s * loop_.gains.rate_hz; ++k) {
      pushed.fly_period(k == 0 ? pulse : nothing);
      other.fly_period(nothing);
      response.push_back(pushed.error_m() - other.error_m());
    }
    return response;
  }

  const FlownLoop loop_, linear_loop_;
  std::vector<Eigen::Vector3d> pulses_[2];
};

/// Every kind of class whose force is `amplitude_N` at most.
struct NamedClass {
  std::string name;
  Disturbance known;
};
std::vector<NamedClass> classes_up_to(double amplitude_N, double period_s, files::Random& random) {
  Disturbance within, ramps, edges, passes;
  within.amplitude_N = ramps.amplitude_N = edges.variation_N = amplitude_N;
  ramps.rate_N_s = amplitude_N / (0.05 + 0.5 * random.uniform());
  passes.impulse_N_s = amplitude_N * period_s;
  passes.passes = Disturbance::kManyPasses;
  passes.pass_period_s = 0.5 + 3 * random.uniform();
  passes.pass_length_s = period_s;
  return {{"amplitude", within}, {"ramps", ramps}, {"edges", edges}, {"passes", passes}};
}

/// Reports the attacks of each class; of all classes together a third of the totals must be attained to 80 %, so that
/// not exceeding them says something.
void expect_none_exceeded(const std::map<std::string, Attacks>& by_class) {
  int close = 0, same_loop = 0;
  for (const auto& [name, attacks] : by_class) {
    std::cout << name << ": " << attacks.runs << " totals, " << attacks.exceeded << " exceeded, "
              << attacks.close << " of " << attacks.same_loop << " attained to 80 %, closest "
              << attacks.closest << ", " << attacks.excluded << " without a proof\n";
    EXPECT_GE(attacks.runs, 30) << name;
    EXPECT_EQ(attacks.exceeded, 0) << name;
    close += attacks.close;
    same_loop += attacks.same_loop;
  }
  EXPECT_GE(3 * close, same_loop);
}

TEST(FlownLoop, NoAttackOnTheNonlinearVehicleExceedsATotalWhoseConditionIsProved) {
  files::Random random(51);
  std::map<std::string, Attacks> attacks;
  for (int trial = 0; trial < 30; ++trial) {
    const double Kp = 8 + 14 * random.uniform(), Kd = 4 + 6 * random.uniform(), Ki = 1 + 6 * random.uniform();
    const double rate_hz = random.uniform() < 0.5 ? 100 : 50;
    std::string text = "Kp = " + std::to_string(Kp) + "\nKd = " + std::to_string(Kd) +
                       "\nKi = " + std::to_string(Ki) + "\nrate_hz = " + std::to_string(rate_hz) + "\n";
    if (random.uniform() < 0.5) text += "integrator_limit = 0.05\n";
    std::string lag = "[lag]\nmotor_s = " + std::to_string(0.02 + 0.04 * random.uniform()) + "\n";
    if (random.uniform() < 0.3) lag += "attitude_s = 0.03\n";
    if (random.uniform() < 0.3) lag += "delay_s = 0.01\n";
    lag += "[network]\nrate_hz = 50\n";
    const FlownLoop loop = flown_loop(gains_of(text, lag), tests::small_vehicle());
    if (loop.is_stable() != true) continue;
    Attacker<PointVehicle> attacker(loop, without_limits(loop));
    for (const auto& [name, known] : classes_up_to(0.002 + 0.03 * random.uniform(), 1 / rate_hz, random)) {
      if (!saturation(loop, declared(known), {}).is_proved()) {
        ++attacks[name].excluded;
        continue;
      }
      attacker.attack(known, Channel::kForce, 0, attacks[name]);
      if (name == "edges")
        attacker.attack(known, Channel::kCommand, 0, attacks["edges of the learned force"]);
    }
  }
  expect_none_exceeded(attacks);
}

TEST(FlownLoop, NorDoesOneOnTheVehicleWithItsAttitudeLoopInPlaceOfALagThatContainsIt) {
  files::Random random(52);
  std::map<std::string, Attacks> attacks;
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
    Attacker<FullVehicle> attacker(loop, loop);
    // Forces that cause tilts of a degree.
    for (const auto& [name, known] : classes_up_to(1e-4 + 6e-4 * random.uniform(), 0.01, random)) {
      const Saturation thrust = saturation(loop, declared(known), {});
      if (thrust.is_proved())
        attacker.attack(known, Channel::kForce, thrust.beyond_linear_N(), attacks[name]);
      else
        ++attacks[name].excluded;
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

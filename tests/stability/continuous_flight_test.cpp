#include "stability/simulation/continuous_flight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "data.h"
#include "stability/simulation/sampled_flight.h"

namespace swarmcert::stability {
namespace {

Model model(const std::string& name) { return read_model(tests::source_path("stability/models/" + name)); }

Gains gains(const std::string& more = "") {
  return parse_gains(
      "schema = \"swarmcert/gains/1\"\n[position]\nKp = [20, 20, 10]\nKd = [10, 10, 5]\nKi = [3, 3, 10]\n" +
          more + "[attitude]\nlaw = \"lee\"\n",
      "gains.toml");
}

int count(const ContinuousFlight& flight, FlightEvent::What what) {
  return static_cast<int>(std::count_if(flight.events().begin(), flight.events().end(),
                                        [what](const FlightEvent& event) { return event.what == what; }));
}

/// Positions of all vehicles every 0.1 s.
Eigen::VectorXd path(ContinuousFlight& flight, int vehicles, double end_s) {
  const int samples = static_cast<int>(std::lround(end_s / 0.1));
  Eigen::VectorXd result(samples * vehicles * 3);
  for (int k = 0; k < samples; ++k) {
    flight.advance(0.1 * (k + 1));
    for (int i = 0; i < vehicles; ++i) {
      for (int axis = 0; axis < 3; ++axis) result[(k * vehicles + i) * 3 + axis] = flight.state(i)[axis];
    }
  }
  return result;
}

TEST(ContinuousFlight, SolversOfDifferentFamiliesAgree) {
  const auto task = make_task("swap", {2, 9, 0});
  std::vector<Eigen::VectorXd> paths;
  for (const OdeMethod method : {OdeMethod::kBdf, OdeMethod::kAdams, OdeMethod::kRungeKutta}) {
    Swarm swarm(model("crazyflie-small-effects.toml"), 2);
    ContinuousFlightOptions options;
    options.method = method;
    ContinuousFlight flight(swarm, gains(), *task, options);
    paths.push_back(path(flight, 2, 6));
    const double* const q = flight.state(0) + kQuaternion;
    EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-7) << "never normalised";
  }
  EXPECT_LT((paths[0] - paths[2]).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((paths[1] - paths[2]).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(ContinuousFlight, IsTheLimitOfTheSampledLoop) {
  const auto task = make_task("swap", {2, 9, 0});
  std::vector<double> gaps;
  for (const double rate_hz : {500.0, 2000.0}) {
    Swarm swarm(model("crazyflie-small-effects.toml"), 2);
    ContinuousFlight flight(swarm, gains(), *task, {});
    Swarm twin(model("crazyflie-small-effects.toml"), 2);
    SampledFlightOptions options;
    options.attitude_rate_hz = rate_hz;
    options.flies_float = false;
    options.battery_drop_V_s = 0;
    SampledFlight sampled(twin, gains(), *task, options);
    double gap = 0;
    for (int k = 1; k <= 60; ++k) {
      flight.advance(0.1 * k);
      while (sampled.time_s() < 0.1 * k - 1e-9) sampled.step();
      for (int axis = 0; axis < 3; ++axis)
        gap = std::max(gap, std::abs(flight.state(0)[axis] - sampled.state()[axis]));
    }
    gaps.push_back(gap);
  }
  EXPECT_LT(gaps[0], 2e-3);
  EXPECT_LT(gaps[1], 0.4 * gaps[0]) << "first order in the period";
}

TEST(ContinuousFlight, MeetsTheIntegralsClampAndStandsThere) {
  // Reference: with |I| <= 0.1 m s a force of 0.0883 N leaves an error of (0.0883 / m - Ki 0.1) / Kp.
  Model heavy = model("crazyflie-small.toml");
  EffectSpec force;
  force.name = "constant_force";
  force.parameters = {{"force_z_N", -0.0883}};
  heavy.effects.push_back(force);
  Swarm swarm(heavy, 1);
  const auto task = make_task("hover", {1, 40, 0});
  ContinuousFlight flight(swarm, gains("integrator_limit = [0.1, 0.1, 0.1]\n"), *task, {});
  flight.advance(40);
  EXPECT_EQ(count(flight, FlightEvent::What::kIntegralClamp), 1);
  EXPECT_NEAR(0.6 - flight.state(0)[2], (0.0883 / 0.034 - 10 * 0.1) / 10, 1e-7);
}

TEST(ContinuousFlight, MeetsTheThrustLimitAndTheGround) {
  Model heavy = model("crazyflie-small.toml");
  EffectSpec force;
  force.name = "constant_force";
  heavy.mass_kg = 0.075;  // the rotors barely lift it
  force.parameters = {{"force_z_N", -0.25}};
  heavy.effects.push_back(force);
  Swarm swarm(heavy, 1);
  const auto task = make_task("hover", {1, 40, 0});
  ContinuousFlight flight(swarm, gains(), *task, {});
  flight.advance(5);
  EXPECT_GE(count(flight, FlightEvent::What::kThrustLimit), 1);
  EXPECT_EQ(count(flight, FlightEvent::What::kGround), 1);
  EXPECT_EQ(flight.state(0)[2], 0.05);
}

TEST(ContinuousFlight, RefusesDelays) {
  Model late = model("crazyflie-small.toml");
  EffectSpec delay;
  delay.name = "delay";
  late.effects.push_back(delay);
  Swarm swarm(late, 1);
  const auto task = make_task("hover", {1, 1, 0});
  EXPECT_THROW(ContinuousFlight(swarm, gains(), *task, {}), std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert::stability

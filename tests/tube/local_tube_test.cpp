// Proved tubes compared with flights, and tubes that must not be proved.
#include "analysis/tracking/tube/local_tube.h"

#include <gtest/gtest.h>

#include <cmath>

#include "stability/simulation/simulate.h"
#include "tube/axes_flight.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

LocalTubeOptions quick() {
  LocalTubeOptions options;
  options.enclosure.boxes = 16;
  return options;
}

/// Returns the largest errors per vehicle and axis in one flight of the swap with the declared truth.
std::vector<std::array<double, 4>> flown(const stability::Gains& gains, const stability::Model& truth,
                                         const files::Network& network, int vehicles, double duration_s,
                                         std::uint64_t seed, bool noise) {
  std::vector<stability::Model> models = {truth};
  stability::Swarm swarm(std::move(models), std::vector<int>(static_cast<std::size_t>(vehicles), 0));
  swarm.assume_lag(gains.motor_lag_s, gains.delay_s);
  stability::SimulationOptions options;
  options.loop.noise = noise;
  options.loop.seed = seed;
  options.keep_logs = options.keep_errors = false;
  const auto task = stability::make_task("swap", {vehicles, duration_s, 0});
  const stability::Simulation simulation = stability::simulate(swarm, gains, *task, options, &network);
  std::vector<std::array<double, 4>> errors;
  for (const stability::SimulatedVehicle& vehicle : simulation.vehicles)
    errors.push_back(vehicle.error.max_m);
  return errors;
}

/// Returns the declared truth with the lags of the loop.
stability::Model truth_for(const stability::Gains& gains) {
  stability::Model truth = tests::truth_model();
  std::vector<stability::EffectSpec> effects;
  for (const stability::EffectSpec& effect : truth.effects) {
    if (effect.name != "motor_lag" || gains.motor_lag_s > 0) effects.push_back(effect);
  }
  truth.effects = effects;
  return truth;
}

TEST(LocalTube, HoldsEveryFlightOfItsSwap) {
  const files::Network network = tests::demo_network();
  // Gains that state the vehicle's attitude response, which the simulator includes and composite.toml omits. No tube
  // includes the reduced lift of a tilted thrust, which affects only the height.
  const double left_out_m[] = {0, 0, 5e-5};
  const stability::FlownLoop loop = tests::loop_of("firmware-defaults");
  const stability::Model truth = tests::truth_model();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  const LocalTube tube = local_tube(loop, truth, network, *task, 2, quick());
  ASSERT_TRUE(tube.proved) << tube.why;
  EXPECT_TRUE(tube.is_sampled);
  double reached = 0;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const auto errors = flown(loop.gains, truth, network, 2, 4.5, seed, false);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_LE(errors[i][axis], tube.whole[i].position_m[axis].mag() + left_out_m[axis])
            << seed << " " << i << " " << axis;
      reached = std::max(reached, errors[i][2] / largest_position_m(tube.whole, 2));
    }
  }
  EXPECT_GT(reached, 0.1) << "a tube ten times wider than what flies would hide a fault";
}

TEST(LocalTube, MotorsLagAsTheTruthSaysWhateverTheGainsState) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  stability::FlownLoop stated = tests::loop_of("firmware-defaults");
  stated.gains.motor_lag_s = stated.gains.attitude_lag_s = 0;
  stability::FlownLoop flies = stated;
  for (const stability::EffectSpec& effect : truth.effects)
    if (effect.name == "motor_lag") flies.gains.motor_lag_s = effect.parameters.at("tau_s");
  const auto outside = [&](const LocalTube& tube) {
    int count = 0;
    files::Random random(3);
    tests::AxesFlight(flies, truth, network, *task, 2, true)
        .fly(random, [&](double t, int vehicle, const std::array<double, 3>& e, const auto&) {
          const auto at = static_cast<std::size_t>(std::floor((t - 1e-9) / tube.slice_s));
          const Deviation& slice = tube.sliced.slices[at][static_cast<std::size_t>(vehicle)];
          for (std::size_t k = 0; k < 3; ++k)
            if (e[k] < slice.position_m[k].lower || e[k] > slice.position_m[k].upper) ++count;
        });
    return count;
  };
  const LocalTube tube = local_tube(stated, truth, network, *task, 2, quick());
  ASSERT_TRUE(tube.proved && tube.is_sampled) << tube.why;
  EXPECT_EQ(outside(tube), 0);
  const LocalTube without = local_tube(stated, truth_for(stated.gains), network, *task, 2, quick());
  ASSERT_TRUE(without.proved && without.is_sampled) << without.why;
  EXPECT_GT(outside(without), 0) << "the lag must show";
}

TEST(LocalTube, GainsTooWeakForTheForceAreInconclusiveAndSayWhen) {
  stability::FlownLoop loop = tests::loop_of("composite");
  loop.gains.composite->Lambda_1_s = scaled(0.03, loop.gains.composite->Lambda_1_s);
  loop.gains.composite->K_kg_s = scaled(0.05, loop.gains.composite->K_kg_s);
  const auto task = stability::make_task("swap", {2, 9, 0});
  const LocalTube tube = local_tube(loop, truth_for(loop.gains), tests::demo_network(), *task, 2, quick());
  EXPECT_FALSE(tube.proved);
  EXPECT_NE(tube.why.find("errors could exceed 0.5 m"), std::string::npos) << tube.why;
  EXPECT_TRUE(tube.whole.empty());
}

TEST(LocalTube, TheShippedGainsAreProvedAndTheWholeIsTheHullOfItsSlices) {
  const files::Network network = tests::demo_network();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  for (const char* const gains : {"composite", "crazyflie-small", "crazyflie-large"}) {
    SCOPED_TRACE(gains);
    const stability::FlownLoop loop = tests::loop_of(gains);
    const LocalTube tube = local_tube(loop, truth_for(loop.gains), network, *task, 2, quick());
    ASSERT_TRUE(tube.proved) << tube.why;
    ASSERT_EQ(tube.sliced.slices.size(), std::size_t(std::lround(tube.duration_s / tube.slice_s)));
    double largest_m = 0, force_error_N = 0;
    for (std::size_t n = 0; n < tube.sliced.slices.size(); ++n) {
      for (std::size_t i = 0; i < 2; ++i) {
        force_error_N = std::max(force_error_N, tube.sliced.force_error_N[i][n].mag());
        for (std::size_t k = 0; k < 3; ++k) {
          const Interval e = tube.sliced.slices[n][i].position_m[k];
          ASSERT_LE(e.lower, e.upper);
          ASSERT_GE(e.lower, tube.whole[i].position_m[k].lower);
          ASSERT_LE(e.upper, tube.whole[i].position_m[k].upper);
          largest_m = std::max(largest_m, e.mag());
        }
      }
    }
    EXPECT_EQ(largest_m, largest_position_m(tube.whole));
    EXPECT_EQ(force_error_N, std::max(tube.largest_force_error_N(0), tube.largest_force_error_N(1)));
  }
}

TEST(LocalTube, UnstableOrDelayedLoopsAndTruthsWithoutEnclosureAreRefused) {
  const files::Network network = tests::demo_network();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  stability::FlownLoop delayed = tests::loop_of("composite");
  delayed.gains.delay_s = 0.01;
  EXPECT_NE(local_tube(delayed, tests::truth_model(), network, *task, 2, quick()).why.find("delay"),
            std::string::npos);
  stability::Model slow = tests::truth_model();
  for (stability::EffectSpec& effect : slow.effects)
    if (effect.name == "motor_lag") effect.parameters["tau_s"] = 0.3;  // Routh: at most 8/(9 x 4) s
  EXPECT_NE(local_tube(tests::loop_of("composite"), slow, network, *task, 2, quick()).why.find("stable"),
            std::string::npos);
  stability::Model tail = tests::truth_model();
  for (stability::EffectSpec& effect : tail.effects)
    if (effect.name == "downwash") effect.parameters["tail"] = 1;
  EXPECT_NE(local_tube(tests::loop_of("composite"), tail, network, *task, 2, quick()).why.find("tail"),
            std::string::npos);
}

TEST(LocalTube, WhatWasInterruptedProvesNothing) {
  const std::atomic<bool> cancelled{true};
  LocalTubeOptions options = quick();
  options.enclosure.cancelled = &cancelled;
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  const LocalTube tube =
      local_tube(tests::loop_of("composite"), tests::truth_model(), tests::demo_network(), *task, 2, options);
  EXPECT_TRUE(tube.cancelled);
  EXPECT_FALSE(tube.proved);
  EXPECT_EQ(tube.why, "interrupted");
}

}  // namespace
}  // namespace swarmcert::analysis

// Proved tubes compared with flights, and tubes that must not be proved.
#include "analysis/tracking/tube/local_tube.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "stability/simulation/simulate.h"
#include "tube/axes_flight.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

LocalTubeOptions quick() {
  LocalTubeOptions options;
  options.enclosure.boxes = 4;
  options.nodes = 20;
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

TEST(LocalTube, HoldsEveryFlightOfItsSwapAndOrdersTheBounds) {
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
  ASSERT_EQ(tube.rows.size(), 3u);
  double reached = 0;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const auto errors = flown(loop.gains, truth, network, 2, 4.5, seed, false);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_LE(errors[i][axis], tube.tube.radii.position_m[i][axis] + left_out_m[axis])
            << seed << " " << i << " " << axis;
      reached = std::max(reached, errors[i][2] / tube.tube.radius_m(2));
    }
  }
  EXPECT_GT(reached, 0.1) << "a tube ten times wider than what flies would hide a fault";
  const double direct = tube.tube.radius_m(2);
  double last = direct;
  for (auto row = tube.rows.rbegin(); row != tube.rows.rend(); ++row) {  // local, global, product
    if (!row->tube.proved) continue;
    EXPECT_GE(row->tube.radius_m(2), last) << row->name;
    last = row->tube.radius_m(2);
  }
  // The bound from slices exceeds neither the tube's radius nor, up to round-off, the bound from the amplitude.
  for (const ForceErrorBounds& b : tube.bounds) {
    const double radius_m = tube.tube.radii.position_m[static_cast<std::size_t>(b.vehicle)][2];
    EXPECT_LE(b.by_slices_m, radius_m);
    EXPECT_LE(b.by_slices_m, b.by_amplitude_m * (1 + 1e-9));
    EXPECT_GT(b.by_rate_m, 0);
    EXPECT_TRUE(std::isfinite(b.by_edges_m));
    EXPECT_GE(b.impulse_N_s, 0);
  }
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
          const Deviation& slice = tube.slices[at][static_cast<std::size_t>(vehicle)];
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

TEST(LocalTube, GainsTooWeakForTheForceAreInconclusiveAndSayHowMuchComesBack) {
  stability::FlownLoop loop = tests::loop_of("composite");
  loop.gains.composite->Lambda_1_s = scaled(0.03, loop.gains.composite->Lambda_1_s);
  loop.gains.composite->K_kg_s = scaled(0.05, loop.gains.composite->K_kg_s);
  const auto task = stability::make_task("swap", {2, 9, 0});
  const LocalTube tube = local_tube(loop, truth_for(loop.gains), tests::demo_network(), *task, 2, quick());
  EXPECT_FALSE(tube.proved);
  EXPECT_NE(tube.why.find("grow"), std::string::npos) << tube.why;
  EXPECT_NE(tube.why.find("errors could exceed 0.5 m"), std::string::npos) << tube.why;
  EXPECT_GT(tube.tube.loop_gain, 0.5);
  EXPECT_TRUE(tube.bounds.empty());
}

TEST(LocalTube, SliceBySliceTheShippedGainsAreProvedWhereOneRadiusHasAGainAboveOneAndNeverWider) {
  const files::Network network = tests::demo_network();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  for (const auto& [gains, one_radius] : {std::pair("composite", true), std::pair("crazyflie-small", false),
                                          std::pair("crazyflie-large", false)}) {
    SCOPED_TRACE(gains);
    const stability::FlownLoop loop = tests::loop_of(gains);
    const LocalTube tube = local_tube(loop, truth_for(loop.gains), network, *task, 2, quick());
    ASSERT_TRUE(tube.proved) << tube.why;
    ASSERT_TRUE(tube.sliced.proved);
    EXPECT_EQ(tube.one_radius.proved, one_radius);
    EXPECT_TRUE(tube.tube.radii.within(tube.sliced.radii()));
    if (one_radius) {
      EXPECT_TRUE(tube.tube.radii.within(tube.one_radius.radii));
      EXPECT_LT(tube.tube.radius_m(2), 0.7 * tube.one_radius.radius_m(2));
    }
    ASSERT_EQ(tube.slices.size(), tube.sliced.slices.size());
    for (std::size_t n = 0; n < tube.slices.size(); ++n) {
      for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          const Interval e = tube.slices[n][i].position_m[k];
          ASSERT_LE(e.lower, e.upper);
          ASSERT_GE(e.lower, tube.sliced.slices[n][i].position_m[k].lower);
          ASSERT_LE(e.mag(), tube.tube.radii.position_m[i][k]);
        }
      }
    }
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

/// A force bound that returns preset values.
class ToldBound final : public ForceBound {
 public:
  ToldBound(const Scene& scene, double constant_N, double per_metre_N)
      : scene_(scene), constant_N_(constant_N), slope_(per_metre_N) {}
  bool prepare(const Radii&, const std::vector<TruthSizes>&) override { return true; }
  std::vector<double> sizes(const Radii& radii) const override {
    return std::vector<double>(scene_.motion().stretches.size(),
                               constant_N_ + slope_ * radii.largest_position_m(2));
  }

 private:
  const Scene& scene_;
  double constant_N_, slope_;
};

TEST(LeastTube, FindsTheFixedPointOfAnAffineForceAndRefusesGainsOfOneAndMoreAndWhatIsNoNumber) {
  stability::Model truth = tests::truth_model();
  truth.effects.clear();
  const auto task = stability::make_task("hover", {2, 10, 0});
  const Scene scene(tests::loop_of("composite"), truth, tests::demo_network(), *task, 2, 0);
  // Triple pole: |h'|_1 = 4 e^-2 / (m a^2) = 0.9951 m/N, reached within 10 s.
  const double gain = 0.99511237674;
  for (const double slope : {0.0, 0.3, 0.8}) {
    ToldBound bound(scene, 0.01, slope);
    const LeastTube tube = least_tube(scene, bound);
    ASSERT_TRUE(tube.proved) << slope;
    const double exact = 0.01 * gain / (1 - gain * slope);
    EXPECT_GT(tube.radius_m(2), exact);
    EXPECT_LT(tube.radius_m(2), exact * 1.012) << slope;
    EXPECT_NEAR(tube.loop_gain, gain * slope, 0.02);
  }
  for (const double slope :
       {1.006, 3.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ToldBound bound(scene, 0.01, slope);
    EXPECT_FALSE(least_tube(scene, bound).proved) << slope;
  }
}

}  // namespace
}  // namespace swarmcert::analysis

// Tubes, slice by slice, compared with flights of the loop they describe.
#include "analysis/tracking/tube/sliced_tube.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tube/axes_flight.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

constexpr double kTolerance_N = 1e-3;

EnclosureOptions boxes(int count) {
  EnclosureOptions options;
  options.boxes = count;
  return options;
}

/// How often flights were outside their slice, and how close to the edge they came inside it: 1 at the edge.
struct Seen {
  int looks = 0, outside = 0;
  double nearest = 0;
};

Seen fly(const stability::FlownLoop& loop, const stability::Model& truth, const stability::Task& task,
         const SlicedTube& tube, double slice_s, int flights, bool is_sampled = false,
         const EstimateErrors& estimates = {}, const std::optional<Interval>& motor_lag_s = {}) {
  const int vehicles = static_cast<int>(tube.slices.front().size());
  const files::Network network = tests::demo_network();
  tests::AxesFlight flight(loop, truth, network, task, vehicles, is_sampled, estimates, motor_lag_s);
  files::Random random(11);
  Seen seen;
  const auto check = [&seen](Interval range, double value) {
    ++seen.looks;
    const double middle = (range.lower + range.upper) / 2;
    const double share = std::abs(value - middle) / (range.upper - middle);
    if (value < range.lower || value > range.upper) ++seen.outside;
    // Movements of less than a tenth of a millimetre show only round-off.
    if (range.upper - range.lower > 1e-4) seen.nearest = std::max(seen.nearest, share);
  };
  for (int i = 0; i < flights; ++i) {
    flight.fly(random,
               [&](double t, int vehicle, const std::array<double, 3>& e, const std::array<double, 3>& v) {
                 const auto at = static_cast<std::size_t>(std::floor((t - 1e-9) / slice_s));
                 const Deviation& slice = tube.slices[at][static_cast<std::size_t>(vehicle)];
                 for (std::size_t k = 0; k < 3; ++k) {
                   check(slice.position_m[k], e[k]);
                   check(slice.velocity_m_s[k], v[k]);
                 }
               });
  }
  return seen;
}

TEST(SlicedTube, HoldsEveryFlightInEverySliceForAllShippedGainsAndTwoAndThreeVehicles) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  for (const auto& [gains, vehicles] :
       {std::pair("composite", 2), std::pair("composite", 3), std::pair("crazyflie-small", 2),
        std::pair("crazyflie-large", 2), std::pair("crazyflie-small-nominal", 2),
        std::pair("firmware-defaults", 2)}) {
    SCOPED_TRACE(gains + std::string(", vehicles: ") + std::to_string(vehicles));
    const stability::FlownLoop loop = tests::loop_of(gains);
    const auto task = stability::make_task("swap", {vehicles, 4.5, 0});
    const Scene scene(loop, truth, network, *task, vehicles, network_age_s(loop.gains));
    const SlicedTube tube = sliced_tube(scene, boxes(vehicles == 2 ? 8 : 2), kTolerance_N);
    ASSERT_TRUE(tube.proved) << tube.why;
    ASSERT_EQ(tube.slices.size(), static_cast<std::size_t>(scene.motion().slices));
    const Seen seen = fly(loop, truth, *task, tube, scene.motion().slice_s, 3);
    EXPECT_EQ(seen.outside, 0) << "of " << seen.looks;
    EXPECT_GT(seen.nearest, 0.4) << "a tube that no flight comes near to would hide a fault";
  }
}

TEST(SlicedTube, SampledFlightsThatLeaveTheContinuousTubeStayInTheSampledOne) {
  const files::Network network = tests::demo_network();
  stability::Model truth = tests::truth_model();
  truth.effects.clear();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  stability::FlownLoop loop = tests::loop_of("firmware-defaults");
  loop.gains.rate_hz = 40;
  loop.gains.integrator_step_s = 0.025;
  const auto tube_of = [&](bool is_sampled) {
    const Scene scene(loop, truth, network, *task, 2, network_age_s(loop.gains, is_sampled), kSlice_s,
                      is_sampled);
    EXPECT_EQ(scene.loops().is_sampled(), is_sampled);
    return sliced_tube(scene, boxes(8), kTolerance_N);
  };
  const SlicedTube narrow = tube_of(false), wide = tube_of(true);
  ASSERT_TRUE(narrow.proved) << narrow.why;
  ASSERT_TRUE(wide.proved) << wide.why;
  const double slice_s = task->duration_s() / static_cast<double>(wide.slices.size());
  EXPECT_EQ(fly(loop, truth, *task, narrow, slice_s, 1).outside, 0);
  EXPECT_GT(fly(loop, truth, *task, narrow, slice_s, 1, true).outside, 0);
  const Seen seen = fly(loop, truth, *task, wide, slice_s, 3, true);
  EXPECT_EQ(seen.outside, 0) << "of " << seen.looks;
  EXPECT_GT(seen.nearest, 0.2) << "a tube that no flight comes near to would hide a fault";
}

TEST(SlicedTube, SampledTubesHoldSampledFlightsAndAreLittleWiderThanContinuousOnes) {
  const files::Network network = tests::demo_network();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  // At 500 Hz and at 100 Hz, where predictions also use states twice as old.
  for (const auto& [gains, most] :
       {std::pair("firmware-defaults", 1.08), std::pair("crazyflie-small", 1.35)}) {
    SCOPED_TRACE(gains);
    const stability::FlownLoop loop = tests::loop_of(gains);
    double radius_m[2][3];
    for (const bool is_sampled : {false, true}) {
      const Scene scene(loop, tests::truth_model(), network, *task, 2, network_age_s(loop.gains, is_sampled),
                        kSlice_s, is_sampled);
      const SlicedTube tube = sliced_tube(scene, boxes(8), kTolerance_N);
      ASSERT_TRUE(tube.proved) << tube.why;
      for (int k = 0; k < 3; ++k) radius_m[is_sampled ? 1 : 0][k] = largest_position_m(tube.whole(), k);
      if (!is_sampled) continue;
      const Seen seen = fly(loop, tests::truth_model(), *task, tube, scene.motion().slice_s, 3, true);
      EXPECT_EQ(seen.outside, 0) << "of " << seen.looks;
      EXPECT_GT(seen.nearest, 0.3) << "a tube that no flight comes near to would hide a fault";
    }
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(radius_m[1][k], radius_m[0][k]) << k;
      EXPECT_LE(radius_m[1][k], most * radius_m[0][k]) << k;
    }
  }
}

TEST(SlicedTube, OverTheDefaultSwapTheSampledTubeIsAtMostOneAndAHalfTimesTheContinuousOne_slow) {
  const files::Network network = tests::demo_network();
  const auto task = stability::make_task("swap", {2, 0, 0});
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  Deviations whole[2];
  for (const bool is_sampled : {false, true}) {
    const Scene scene(loop, tests::truth_model(), network, *task, 2, network_age_s(loop.gains, is_sampled),
                      kSlice_s, is_sampled);
    const SlicedTube tube = sliced_tube(scene, boxes(32), kTolerance_N);
    ASSERT_TRUE(tube.proved) << tube.why;
    whole[is_sampled ? 1 : 0] = tube.whole();
  }
  for (int k = 0; k < 3; ++k)
    EXPECT_LE(largest_position_m(whole[1], k), 1.5 * largest_position_m(whole[0], k)) << k;
}

TEST(SlicedTube, OfAnIntervalOfLagsHoldsFlightsOfAnyLagInItAndIsLittleWider) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  for (const bool is_sampled : {false, true}) {
    SCOPED_TRACE(is_sampled ? "sampled" : "continuous");
    const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
    const double lag_s = loop.gains.motor_lag_s;
    const Interval within(0.9 * lag_s, 1.1 * lag_s);
    const auto tube_of = [&](const Interval& lags_s) {
      const Scene scene(loop, truth, network, *task, 2, network_age_s(loop.gains, is_sampled), kSlice_s,
                        is_sampled, {}, lags_s);
      return sliced_tube(scene, boxes(8), kTolerance_N);
    };
    const SlicedTube one = tube_of(lag_s), all = tube_of(within);
    ASSERT_TRUE(one.proved) << one.why;
    ASSERT_TRUE(all.proved) << all.why;
    for (int k = 0; k < 3; ++k) {
      const double ratio = largest_position_m(all.whole(), k) / largest_position_m(one.whole(), k);
      EXPECT_GT(ratio, 1.02) << k;
      EXPECT_LT(ratio, 1.15) << k;
    }
    const double slice_s = task->duration_s() / static_cast<double>(all.slices.size());
    const Seen seen = fly(loop, truth, *task, all, slice_s, 10, is_sampled, {}, within);
    EXPECT_EQ(seen.outside, 0) << "of " << seen.looks;
    EXPECT_GT(seen.nearest, 0.8) << "a tube that no flight comes near to would hide a fault";
    EXPECT_GT(fly(loop, truth, *task, all, slice_s, 1, is_sampled, {}, 1.5 * lag_s).outside, 0);
  }
}

TEST(SlicedTube, OverTheDefaultSwapTheTubeOfAnIntervalOfLagsIsAtMostOneAndAHalfTimesThatOfOneLag_slow) {
  const files::Network network = tests::demo_network();
  const auto task = stability::make_task("swap", {2, 0, 0});
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  const double lag_s = loop.gains.motor_lag_s;
  const auto whole_of = [&](const Interval& lags_s) {
    const Scene scene(loop, tests::truth_model(), network, *task, 2, network_age_s(loop.gains, true),
                      kSlice_s, true, {}, lags_s);
    const SlicedTube tube = sliced_tube(scene, boxes(32), kTolerance_N);
    EXPECT_TRUE(tube.proved) << tube.why;
    return tube.whole();
  };
  const Deviations one = whole_of(lag_s), all = whole_of({0.9 * lag_s, 1.1 * lag_s});
  for (int k = 0; k < 3; ++k) EXPECT_LE(largest_position_m(all, k), 1.5 * largest_position_m(one, k)) << k;
}

TEST(SlicedTube, HoldsFlightsWhoseEstimatesAreWrongWithinTheirBounds) {
  const files::Network network = tests::demo_network();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  struct WrongEstimates {
    const char* gains;
    bool is_sampled;
    EstimateErrors estimates;
  };
  for (const WrongEstimates& c :
       {WrongEstimates{"composite", false, {{0.005, 0.005, 0.005}, {0.001, 0.001, 0.002}}},
        WrongEstimates{"crazyflie-small", false, {{0.01, 0.01, 0.01}, {0, 0, 0}}},
        WrongEstimates{"crazyflie-small", true, {{0, 0, 0}, {0.003, 0.002, 0.002}}},
        WrongEstimates{"firmware-defaults", true, {{0.02, 0.01, 0.02}, {0.002, 0.001, 0.001}}}}) {
    SCOPED_TRACE(c.gains + std::string(c.is_sampled ? ", sampled" : ", continuous"));
    const stability::FlownLoop loop = tests::loop_of(c.gains);
    const Scene scene(loop, tests::truth_model(), network, *task, 2, network_age_s(loop.gains, c.is_sampled),
                      kSlice_s, c.is_sampled, c.estimates);
    const SlicedTube tube = sliced_tube(scene, boxes(4), kTolerance_N);
    ASSERT_TRUE(tube.proved) << tube.why;
    const double slice_s = scene.motion().slice_s;
    const Seen seen = fly(loop, tests::truth_model(), *task, tube, slice_s, 3, c.is_sampled, c.estimates);
    EXPECT_EQ(seen.outside, 0) << "of " << seen.looks;
    EXPECT_GT(seen.nearest, 0.4) << "a tube that no flight comes near to would hide a fault";
    EstimateErrors larger = c.estimates;
    for (double* const sizes : {larger.velocity_m_s, larger.position_m})
      for (int k = 0; k < 3; ++k) sizes[k] *= 4;
    EXPECT_GT(fly(loop, tests::truth_model(), *task, tube, slice_s, 1, c.is_sampled, larger).outside, 0);
  }
}

TEST(SlicedTube, FlightsOfAnotherLoopOrAnotherTruthLeaveIt) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  const Scene scene(loop, truth, network, *task, 2, network_age_s(loop.gains));
  const SlicedTube tube = sliced_tube(scene, boxes(8), kTolerance_N);
  ASSERT_TRUE(tube.proved) << tube.why;
  stability::FlownLoop slower = loop;
  slower.gains.attitude_lag_s *= 1.5;
  EXPECT_GT(fly(slower, truth, *task, tube, scene.motion().slice_s, 1).outside, 0);
  stability::Model stronger = truth;
  for (stability::EffectSpec& effect : stronger.effects)
    if (effect.name == "drag_linear") effect.parameters["drag_N_s_m"] *= 3;
  EXPECT_GT(fly(loop, stronger, *task, tube, scene.motion().slice_s, 1).outside, 0);
}

TEST(SlicedTube, FinerSlicesAreNeverWiderAndLaterSlicesChangeNothingBefore) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  double last_m = 1;
  for (const double slice_s : {0.05, 0.025, 0.0125}) {
    const auto task = stability::make_task("swap", {2, 4.5, 0});
    const Scene scene(loop, truth, network, *task, 2, network_age_s(loop.gains), slice_s);
    const SlicedTube tube = sliced_tube(scene, boxes(8), kTolerance_N);
    ASSERT_TRUE(tube.proved) << slice_s << " " << tube.why;
    const double radius_m = largest_position_m(tube.whole(), 2);
    EXPECT_LT(radius_m, last_m) << slice_s;
    last_m = radius_m;
    const auto shorter = stability::make_task("swap", {2, 3, 0});
    const Scene start(loop, truth, network, *shorter, 2, network_age_s(loop.gains), slice_s);
    const SlicedTube first = sliced_tube(start, boxes(8), kTolerance_N);
    ASSERT_TRUE(first.proved);
    for (std::size_t n = 0; n + 1 < first.slices.size(); ++n) {
      EXPECT_NEAR(first.slices[n][0].position_m[2].lower, tube.slices[n][0].position_m[2].lower, 1e-9) << n;
      EXPECT_NEAR(first.slices[n][0].position_m[2].upper, tube.slices[n][0].position_m[2].upper, 1e-9) << n;
    }
  }
}

TEST(SlicedTube, SaysWhenErrorsCouldGoTooFarAndProvesNothingWhenInterrupted) {
  const files::Network network = tests::demo_network();
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  const Scene scene(loop, tests::truth_model(), network, *task, 2, network_age_s(loop.gains));
  const SlicedTube near = sliced_tube(scene, boxes(1), kTolerance_N, 0.02);
  EXPECT_FALSE(near.proved);
  EXPECT_NE(near.why.find("0.02 m"), std::string::npos) << near.why;
  const std::atomic<bool> cancelled{true};
  EnclosureOptions options = boxes(1);
  options.cancelled = &cancelled;
  const SlicedTube none = sliced_tube(scene, options, kTolerance_N);
  EXPECT_FALSE(none.proved);
  EXPECT_TRUE(none.cancelled);
}

}  // namespace
}  // namespace swarmcert::analysis

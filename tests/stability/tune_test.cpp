#include "stability/sweep/tune.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>

#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

constexpr double kLoopPeriod_s = 0.002;

SampledLoop shipped() { return {{tests::kMass_kg, 10, 5, 10, {0.0575}, 0}, kLoopPeriod_s, kLoopPeriod_s}; }

TuneOptions options_with(const TuneConstraints& constraints) {
  TuneOptions options;
  options.constraints = constraints;
  options.global_evaluations = 400;
  options.local_evaluations = 100;
  return options;
}

TuneConstraints slack_of(const TunedPoint& point) {
  return {2 * point.noise_m_s2, point.lag_limit_s / 2, 0, 0};
}

TEST(Tune, WhatItReturnsSatisfiesEveryConstraintAndIsNotWorseThanWhatWasGiven) {
  for (const TuneObjective objective :
       {&GainNorms::amplitude, &GainNorms::impulse, &GainNorms::edge, &GainNorms::rate}) {
    TuneOptions options = options_with(slack_of(evaluate_gains(shipped(), {})));
    options.objective = objective;
    const TuneResult result = tune(shipped(), options);
    ASSERT_TRUE(result.shipped.feasible);
    ASSERT_TRUE(result.best.feasible);
    EXPECT_LT(result.best.objective, result.shipped.objective);
    EXPECT_LE(result.best.noise_m_s2, options.constraints.most_noise_m_s2 * (1 + 1e-9));
    EXPECT_GE(result.best.lag_limit_s, options.constraints.least_lag_limit_s * (1 - 1e-9));
    EXPECT_FALSE(result.stopped.empty());
  }
}

TEST(Tune, WhatItStatesOfTheBestGainsIsWhatTheyHave) {
  const TunedPoint start = evaluate_gains(shipped(), {});
  const TuneResult result = tune(shipped(), options_with(slack_of(start)));
  SampledLoop best = shipped();
  best.plant.Kp = result.best.Kp;
  best.plant.Kd = result.best.Kd;
  best.plant.Ki = result.best.Ki;
  const TunedPoint again = evaluate_gains(best, {});
  EXPECT_EQ(again.objective, result.best.objective);
  EXPECT_EQ(again.noise_m_s2, result.best.noise_m_s2);
  EXPECT_EQ(again.lag_limit_s, result.best.lag_limit_s);
}

TEST(Tune, GainsUnderWhichTheDeclaredDisturbanceLeavesNoThrustAreNotProposed) {
  TuneOptions options = options_with(slack_of(evaluate_gains(shipped(), {})));
  options.objective = nullptr;  // the error: here a large one where Kp is small
  options.under_disturbance = [](const SampledLoop& loop) {
    return DisturbedLoop{1 / loop.plant.Kp, 12 - loop.plant.Kp};
  };
  const TuneResult found = tune(shipped(), options);
  ASSERT_TRUE(found.best.feasible);
  EXPECT_LE(found.best.Kp, 12);
  EXPECT_NEAR(found.best.Kp, 12, 0.05);
  EXPECT_EQ(found.best.objective, 1 / found.best.Kp);
}

TEST(Tune, ALoopWithoutIntegratorKeepsNone) {
  SampledLoop loop = shipped();
  loop.plant.Ki = 0;
  const TuneResult result = tune(loop, options_with(slack_of(evaluate_gains(loop, {}))));
  EXPECT_EQ(result.best.Ki, 0);
}

TEST(Tune, ARateBelowWhatTheLargestIntegratorGainAllowsIsProvedInfeasible) {
  const TunedPoint start = evaluate_gains(shipped(), {});
  TuneConstraints constraints = slack_of(start);
  const TuneOptions usual = options_with(constraints);
  const double largest_Ki = shipped().plant.Ki * usual.range;
  constraints.most_rate = 0.9 / (tests::kMass_kg * largest_Ki);  // the rate gain is at least 1 / (m Ki)
  const TuneResult result = tune(shipped(), options_with(constraints));
  EXPECT_FALSE(result.best.feasible);
  EXPECT_FALSE(result.infeasible.empty());
  EXPECT_FALSE(result.violated.empty());
}

TEST(Tune, AnInterruptedSearchReturnsTheBestGainsSoFar) {
  TuneOptions options = options_with(slack_of(evaluate_gains(shipped(), {})));
  std::atomic<bool> cancelled{false};
  int evaluations = 0;
  options.cancelled = &cancelled;
  options.progress = [&](int, int) { cancelled = ++evaluations >= 150; };
  const TuneResult result = tune(shipped(), options);
  EXPECT_LE(evaluations, 151);
  EXPECT_NE(result.stopped.find("interrupted"), std::string::npos) << result.stopped;
  ASSERT_TRUE(result.best.feasible);
  EXPECT_LT(result.best.objective, result.shipped.objective);
}

TEST(Tune, TheSameSeedGivesTheSameGains) {
  const TuneOptions options = options_with(slack_of(evaluate_gains(shipped(), {})));
  const TuneResult a = tune(shipped(), options), b = tune(shipped(), options);
  EXPECT_EQ(a.best.Kp, b.best.Kp);
  EXPECT_EQ(a.best.Kd, b.best.Kd);
  EXPECT_EQ(a.best.Ki, b.best.Ki);
}

}  // namespace
}  // namespace swarmcert::stability

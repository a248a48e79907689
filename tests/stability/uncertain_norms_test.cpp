#include "stability/bounds/uncertain_norms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace swarmcert::stability {
namespace {

constexpr double kMass_kg = 0.034;
const AxisLoop kLoop = {kMass_kg, 10, 5, 10, {}, 0};

AxisLoop at(double mass, double scale, double lag_s, double delay_s) {
  const double k = scale * kMass_kg / mass;
  return {mass, 10 * k, 5 * k, 10 * k, {lag_s}, delay_s};
}

TEST(UncertainNorms, EncloseEveryLoopOfTheBox) {
  constexpr double kGap = 0.05;
  constexpr int kBudget = 20000;
  const UncertainPlant box = {{0.032, 0.036}, {0.92, 1.08}, {0.05, 0.065}, {0, 0}};
  for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
    const UncertainNorms norms = uncertain_norms(kLoop, box, channel, kGap, kBudget);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto in = [&](const Range& r) { return r.from + unit(random) * (r.to - r.from); };
    for (int i = 0; i < 60; ++i) {
      const GainNorms found = continuous_norms(
          at(in(box.mass_kg), in(box.thrust_scale), in(box.lag_s), in(box.delay_s)), channel);
      ASSERT_LE(found.rate, norms.rate.upper);
      ASSERT_LE(found.amplitude, norms.amplitude.upper);
      ASSERT_LE(found.edge, norms.edge.upper);
      ASSERT_LE(found.impulse, norms.impulse.upper);
    }
    // What was asked for: 5 %, reached before the budget of evaluations is spent.
    EXPECT_LE(norms.amplitude.upper, (1 + kGap) * norms.amplitude.lower);
    EXPECT_LE(norms.impulse.upper, (1 + kGap) * norms.impulse.lower);
    EXPECT_LT(norms.evaluations, kBudget);
    const UncertainGain& worst = norms.amplitude;
    EXPECT_NEAR(continuous_norms(at(worst.mass_kg, worst.thrust_scale, worst.lag_s, worst.delay_s), channel)
                    .amplitude,
                worst.lower, 1e-9 * worst.lower);
  }
}

TEST(UncertainNorms, APointIsItsOwnSupremum) {
  const UncertainPlant point = {{kMass_kg, kMass_kg}, {1, 1}, {0.05, 0.05}, {0, 0}};
  const UncertainNorms norms = uncertain_norms(kLoop, point, Channel::kForce);
  const double exact = continuous_norms(at(kMass_kg, 1, 0.05, 0), Channel::kForce).amplitude;
  EXPECT_NEAR(norms.amplitude.lower, exact, 1e-9);
  EXPECT_NEAR(norms.amplitude.upper, exact, 1e-9);
}

TEST(UncertainNorms, ABoxWithAnUnstableCornerHasNoFiniteBound) {
  const UncertainPlant box = {{0.032, 0.036}, {0.9, 1.1}, {0.05, 0.5}, {0, 0}};
  EXPECT_TRUE(std::isinf(uncertain_norms(kLoop, box, Channel::kForce, 0.1, 200).amplitude.upper));
}

}  // namespace
}  // namespace swarmcert::stability

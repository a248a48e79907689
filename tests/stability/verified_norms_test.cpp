#include "stability/bounds/enclosures/verified_norms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "stability/enclosure.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::encloses;
using tests::kMass_kg;

TEST(VerifiedNorms, EncloseClosedFormsAndAreNarrow) {
  // To the eight digits that the command line prints. Triple pole: |h|_1 = 1/(m a^3), |h|_oo = 2 e^-2/(m a^2), |h'|_1
  // twice that.
  const double a = 4;
  const auto norms = verified_norms({kMass_kg, 3 * a * a, 3 * a, a * a * a, {}, 0}, Channel::kForce);
  ASSERT_TRUE(norms.has_value());
  EXPECT_TRUE(encloses(norms->rate, 1 / (kMass_kg * a * a * a), 1e-8));
  EXPECT_TRUE(encloses(norms->amplitude, 4 * std::exp(-2.0) / (kMass_kg * a * a), 1e-8));
  EXPECT_TRUE(encloses(norms->edge, 2 * std::exp(-2.0) / (kMass_kg * a * a), 1e-8));
  EXPECT_TRUE(encloses(norms->impulse,
                       (2 - std::sqrt(2.0) - std::pow(2 - std::sqrt(2.0), 2) / 2) *
                           std::exp(std::sqrt(2.0) - 2) / (kMass_kg * a),
                       1e-8));
}

TEST(VerifiedNorms, TheEstimateLiesInsideForLoopsOfAnyPolePattern) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  int verified = 0;
  while (verified < 8) {
    AxisLoop loop = {
        kMass_kg, std::exp(3 * unit(random)), std::exp(2.5 * unit(random)), std::exp(3 * unit(random)), {},
        0};
    if (verified % 2 == 1) loop.lags_s = {0.02 + 0.1 * unit(random)};
    if (verified % 4 == 3) loop.lags_s.push_back(0.1 * unit(random));
    loop.lags_s.push_back(0);
    if (!is_stable(loop) || lag_limit(loop) < 0.05) continue;
    const Channel channel = verified % 3 == 0 ? Channel::kCommand : Channel::kForce;
    const auto norms = verified_norms(loop, channel);
    ASSERT_TRUE(norms.has_value());
    const GainNorms estimate = continuous_norms(loop, channel);
    SCOPED_TRACE(testing::Message() << loop.Kp << " " << loop.Kd << " " << loop.Ki);
    // Slow or ill-conditioned loops have wider enclosures.
    EXPECT_TRUE(encloses(norms->rate, estimate.rate, 1e-4));
    EXPECT_TRUE(encloses(norms->amplitude, estimate.amplitude, 1e-4));
    EXPECT_TRUE(encloses(norms->edge, estimate.edge, 1e-7));
    EXPECT_TRUE(encloses(norms->impulse, estimate.impulse, 1e-7));
    ++verified;
  }
}

TEST(VerifiedNorms, WithoutIntegralTheOtherGainsAreEnclosed) {
  for (const double lag_s : {0.0, 0.0575}) {
    const AxisLoop loop = {kMass_kg, 10, 5, 0, {lag_s}, 0};
    const auto norms = verified_norms(loop, Channel::kForce);
    ASSERT_TRUE(norms.has_value());
    const GainNorms estimate = continuous_norms(loop, Channel::kForce);
    EXPECT_TRUE(std::isinf(norms->rate.lower));
    EXPECT_TRUE(encloses(norms->amplitude, estimate.amplitude, 1e-8));
    EXPECT_TRUE(encloses(norms->edge, estimate.edge, 1e-8));
    EXPECT_TRUE(encloses(norms->impulse, estimate.impulse, 1e-8));
  }
  // Critically damped: no overshoot, so the edge gain is that of a constant force, 1/(m Kp).
  const auto norms = verified_norms({kMass_kg, 9, 6, 0, {}, 0}, Channel::kForce);
  ASSERT_TRUE(norms.has_value());
  EXPECT_TRUE(encloses(norms->edge, 1 / (kMass_kg * 9), 1e-8));
}

TEST(VerifiedNorms, GainsOfErrorsOfTheEstimatesAreEnclosed) {
  for (const AxisLoop& loop :
       {AxisLoop{kMass_kg, 10, 5, 10, {1 / 17.4}, 0}, AxisLoop{kMass_kg, 30, 9, 0, {}, 0},
        AxisLoop{kMass_kg, 20, 10, 12, {1 / 17.4, 0.03}, 0.015}}) {
    for (const Estimate estimate : {Estimate::kVelocity, Estimate::kPosition}) {
      const auto norms = verified_norms(loop, estimate);
      ASSERT_TRUE(norms.has_value());
      const GainNorms exact = continuous_norms(loop, estimate);
      EXPECT_TRUE(tests::encloses(norms->amplitude, exact.amplitude, 1e-5, 1e-7));
      EXPECT_TRUE(tests::encloses(norms->edge, exact.edge, 1e-5, 1e-7));
      EXPECT_TRUE(tests::encloses(norms->impulse, exact.impulse, 1e-5, 1e-7));
      if (std::isinf(exact.rate)) {
        EXPECT_TRUE(std::isinf(norms->rate.upper));
      } else {
        EXPECT_TRUE(tests::encloses(norms->rate, exact.rate, 1e-5, 1e-7));
      }
    }
  }
}

TEST(VerifiedNorms, ADelayIsEnclosedNarrowlyUpToTheStabilityLimit) {
  // Zero, one and two lags, no integral, and long delays: half and nine tenths of the destabilising delay.
  std::vector<AxisLoop> loops = {
      {kMass_kg, 10, 5, 10, {0.0575}, 0.02},  {kMass_kg, 20, 10, 3, {0.0575, 0.1}, 0.01},
      {kMass_kg, 48, 12, 64, {0.0575}, 0.01}, {kMass_kg, 10, 5, 0, {0.0575}, 0.008},
      {kMass_kg, 10, 5, 10, {}, 0.02},        {kMass_kg, 48, 12, 64, {}, 0.003}};
  for (const double share : {0.5, 0.9}) {
    loops.push_back({kMass_kg, 48, 12, 64, {}, 0});
    loops.back().delay_s = share * delay_limit(loops.back());
    loops.push_back({kMass_kg, 20, 10, 6, {0.0575}, 0});
    loops.back().delay_s = share * delay_limit(loops.back());
  }
  Channel channel = Channel::kCommand;
  for (const AxisLoop& loop : loops) {
    channel = channel == Channel::kForce ? Channel::kCommand : Channel::kForce;
    const auto norms = verified_norms(loop, channel);
    SCOPED_TRACE(testing::Message() << loop.Kp << " " << loop.Ki << " " << loop.delay_s);
    ASSERT_TRUE(norms.has_value());
    const GainNorms estimate = continuous_norms(loop, channel);
    EXPECT_GT(norms->delay_gain, 0);
    EXPECT_LT(norms->delay_gain, 1e-6);
    constexpr double kWidth = 1e-5;
    constexpr double kOfEstimate = 1e-12;
    if (loop.Ki > 0) {
      EXPECT_TRUE(encloses(norms->rate, estimate.rate, kWidth, kOfEstimate));
    }
    EXPECT_TRUE(encloses(norms->amplitude, estimate.amplitude, kWidth, kOfEstimate));
    EXPECT_TRUE(encloses(norms->edge, estimate.edge, kWidth, kOfEstimate));
    EXPECT_TRUE(encloses(norms->impulse, estimate.impulse, kWidth, kOfEstimate));
  }
}

TEST(VerifiedNorms, AShortDelayOfASlowLoopIsExpanded) {
  // Too many segments for the method of steps.
  const AxisLoop loop = {kMass_kg, 10, 5, 2, {0.0575}, 2e-5};
  const auto norms = verified_norms(loop, Channel::kForce);
  ASSERT_TRUE(norms.has_value());
  const GainNorms estimate = continuous_norms(loop, Channel::kForce);
  EXPECT_GT(norms->delay_gain, 0);
  EXPECT_LT(norms->delay_gain, 1e-5);
  EXPECT_TRUE(encloses(norms->amplitude, estimate.amplitude, 1e-5));
  EXPECT_TRUE(encloses(norms->impulse, estimate.impulse, 1e-5));
}

TEST(VerifiedNorms, ADelayThatDestabilisesIsNotVerified) {
  AxisLoop loop = {kMass_kg, 10, 5, 2, {0.0575}, 0};
  loop.delay_s = 1.1 * delay_limit(loop);
  EXPECT_FALSE(verified_norms(loop, Channel::kForce).has_value());
}

TEST(VerifiedNorms, AnUnstableLoopIsNotVerified) {
  EXPECT_FALSE(verified_norms({kMass_kg, 1, 0.1, 10, {}, 0}, Channel::kForce).has_value());
}

TEST(Interval, EveryOperationIsWiderThanRounding) {
  const Interval third = Interval(1) / Interval(3);
  EXPECT_LT(third.lower, third.upper);
  const Interval one = third * Interval(3);
  EXPECT_LE(one.lower, 1);
  EXPECT_GE(one.upper, 1);
  EXPECT_LT((Interval(0.1) + Interval(0.2)).lower, (Interval(0.1) + Interval(0.2)).upper);
}

}  // namespace
}  // namespace swarmcert::stability

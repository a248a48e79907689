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
        AxisLoop{kMass_kg, 20, 10, 12, {1 / 17.4, 0.03}, 0}}) {
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

TEST(VerifiedNorms, AShortDelayIsEnclosedAsNarrowlyAsItIsShort) {
  // Zero, one and two lags, and no integral.
  const std::vector<AxisLoop> loops = {{kMass_kg, 10, 5, 10, {0.0575}, 0},
                                       {kMass_kg, 20, 10, 3, {0.0575, 0.1}, 0},
                                       {kMass_kg, 10, 5, 0, {0.0575}, 0},
                                       {kMass_kg, 10, 5, 10, {}, 0}};
  Channel channel = Channel::kCommand;
  for (AxisLoop loop : loops) {
    channel = channel == Channel::kForce ? Channel::kCommand : Channel::kForce;
    double wider = 1;
    for (const double delay_s : {4e-3, 1e-3, 2e-5}) {
      loop.delay_s = delay_s;
      SCOPED_TRACE(testing::Message() << loop.Kp << " " << loop.Ki << " " << delay_s);
      const auto norms = verified_norms(loop, channel);
      ASSERT_TRUE(norms.has_value());
      EXPECT_GT(norms->delay_gain, 0);
      EXPECT_LT(norms->delay_gain, wider);
      wider = norms->delay_gain;
      const GainNorms estimate = continuous_norms(loop, channel);
      const double width = 2.1 * norms->delay_gain / (1 - norms->delay_gain) + 1e-5;
      if (loop.Ki > 0) {
        EXPECT_TRUE(encloses(norms->rate, estimate.rate, width, 1e-12));
      }
      EXPECT_TRUE(encloses(norms->amplitude, estimate.amplitude, width, 1e-12));
      EXPECT_TRUE(encloses(norms->edge, estimate.edge, width, 1e-12));
      EXPECT_TRUE(encloses(norms->impulse, estimate.impulse, width, 1e-12));
    }
    EXPECT_LT(wider, 0.02);
  }
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

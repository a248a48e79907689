#include "stability/bounds/enclosures/verified_sampled_norms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "stability/enclosure.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

/// For values that are computed themselves.
testing::AssertionResult encloses_estimate(const Interval& interval, double value, double relative_width,
                                           double estimate_error = 1e-10) {
  return tests::encloses(interval, value, relative_width, estimate_error);
}

/// @param channel the channel, or the estimate that has the error.
template <class Input>
void expect_enclosures(const SampledLoop& loop, Input channel, double width, double width_between) {
  const auto norms = verified_sampled_norms(loop, channel);
  ASSERT_TRUE(norms.has_value());
  const GainNorms at = sampled_norms(loop, channel, Instants::kSampling);
  const GainNorms all = sampled_norms(loop, channel, Instants::kAll);
  EXPECT_TRUE(encloses_estimate(norms->at_samples.amplitude, at.amplitude, width));
  EXPECT_TRUE(encloses_estimate(norms->at_samples.edge, at.edge, width));
  EXPECT_TRUE(encloses_estimate(norms->at_samples.impulse, at.impulse, width));
  EXPECT_TRUE(encloses_estimate(norms->all_times.amplitude, all.amplitude, width_between));
  EXPECT_TRUE(encloses_estimate(norms->all_times.edge, all.edge, width_between));
  EXPECT_TRUE(encloses_estimate(norms->all_times.impulse, all.impulse, width_between));
  if (std::isinf(at.rate)) {
    EXPECT_TRUE(std::isinf(norms->at_samples.rate.lower));
    return;
  }
  EXPECT_TRUE(encloses_estimate(norms->at_samples.rate, at.rate, width));
  EXPECT_TRUE(encloses_estimate(norms->all_times.rate, all.rate, width_between));
}

TEST(VerifiedSampledNorms, EncloseThePublishedTableToItsDigits) {
  // Amplitude and rate gains at 100 Hz and 500 Hz of z 10/5/10 and of the triple pole, as printed; at 100 Hz their
  // quadrature has an error of 8e-8.
  struct Row {
    AxisLoop loop;
    double period_s, step_s, rate, amplitude;
  };
  const AxisLoop z = {kMass_kg, 10, 5, 10, {}, 0};
  const AxisLoop a1 = {kMass_kg, 48, 12, 64, {}, 0};
  for (const Row& row :
       {Row{z, 0.002, 0.002, 3.330897826, 4.993197363}, Row{z, 0.01, 0.01, 3.312277050, 4.978843651},
        Row{z, 0.01, 0.002, 14.705882353, 5.501886995}, Row{a1, 0.01, 0.01, 0.45955882, 0.995138042}}) {
    const auto norms = verified_sampled_norms({row.loop, row.period_s, row.step_s}, Channel::kForce);
    ASSERT_TRUE(norms.has_value());
    EXPECT_TRUE(encloses_estimate(norms->at_samples.rate, row.rate, 1e-8, 1e-8));
    EXPECT_TRUE(encloses_estimate(norms->at_samples.amplitude, row.amplitude, 1e-8, 2e-8));
  }
}

TEST(VerifiedSampledNorms, TheEstimateLiesInsideForAnyLagDelayAndStep) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> unit(0, 1);
  int done = 0;
  for (int i = 0; done < 16 && i < 200; ++i) {
    AxisLoop plant = {kMass_kg * (0.5 + unit(random)),
                      4 + 20 * unit(random),
                      3 + 6 * unit(random),
                      i % 5 == 4 ? 0 : 0.5 + 8 * unit(random),
                      {},
                      0};
    if (i % 2 == 1) plant.lags_s.push_back(0.02 + 0.04 * unit(random));
    if (i % 4 == 3) plant.lags_s.push_back(0.05 * unit(random));
    if (i % 3 != 0) plant.delay_s = 0.02 * unit(random);
    const double period_s = i % 3 == 2 ? 0.01 : 0.004;
    const SampledLoop loop = {plant, period_s, i % 4 == 1 ? period_s / 5 : period_s};
    if (!(spectral_radius(loop) < 0.998)) continue;
    SCOPED_TRACE(testing::Message() << plant.Kp << " " << plant.Kd << " " << plant.Ki << " delay "
                                    << plant.delay_s << " lags " << plant.lags_s.size());
    expect_enclosures(loop, i % 2 == 0 ? Channel::kForce : Channel::kCommand, 1e-6, 1e-3);
    ++done;
  }
  EXPECT_EQ(done, 16);
}

TEST(VerifiedSampledNorms, GainsOfErrorsOfTheEstimatesAreEnclosed) {
  for (const SampledLoop& loop : {SampledLoop{{kMass_kg, 10, 5, 10, {1 / 17.4}, 0.015}, 0.01, 0.002},
                                  SampledLoop{{kMass_kg, 30, 9, 0, {}, 0}, 0.01, 0.01},
                                  SampledLoop{{kMass_kg, 20, 10, 12, {1 / 17.4, 0.03}, 0}, 0.002, 0.002}}) {
    expect_enclosures(loop, Estimate::kVelocity, 1e-6, 1e-2);
    expect_enclosures(loop, Estimate::kPosition, 1e-6, 1e-2);
  }
}

TEST(VerifiedSampledNorms, AnUnstableLoopIsNotVerified) {
  EXPECT_FALSE(
      verified_sampled_norms({{kMass_kg, 10, 5, 10, {}, 0.5}, 0.01, 0.01}, Channel::kForce).has_value());
}

}  // namespace
}  // namespace swarmcert::stability

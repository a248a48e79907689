// Expected bounds: gains by SciPy's DOP853 times the magnitudes of the force when two to five vehicles fly above one.
#include "stability/bounds/disturbance_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "stability/bounds/error_parts.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

constexpr double kLag_s = 1 / 17.4;

AxisLoop pid_loop(double Kp, double Kd, double Ki, double lag_s = 0) {
  return {kMass_kg, Kp, Kd, Ki, {lag_s}, 0};
}

Disturbance known(double rate, double amplitude, double variation, double impulse) {
  Disturbance d;
  d.rate_N_s = rate;
  d.amplitude_N = amplitude;
  d.variation_N = variation;
  d.impulse_N_s = impulse;
  return d;
}

TEST(DisturbanceBounds, FlyUnderEventsOfTheReference) {
  const AxisLoop z2 = pid_loop(10, 5, 2, kLag_s);
  const double E[] = {.0970, .1635, .2077, .2687}, d[] = {.748, 1.209, 1.421, 1.764};
  const double J[] = {.0202, .0354, .0485, .0662};
  const double B1[] = {11.0, 17.8, 20.9, 25.9}, B2[] = {.541, .912, 1.158, 1.499},
               B3[] = {.270, .456, .579, .749};
  const double B4[] = {.0949, .1657, .2274, .3105};
  for (int i = 0; i < 4; ++i) {
    const DisturbanceBounds b = disturbance_bounds(z2, Channel::kForce, known(d[i], E[i], E[i], J[i]));
    EXPECT_NEAR(b.by_rate, B1[i], 0.05);
    EXPECT_NEAR(b.by_amplitude, B2[i], 1e-3);
    EXPECT_NEAR(b.by_edges, B3[i], 1e-3);
    EXPECT_NEAR(b.by_impulse, B4[i], 0.012 * B4[i]);  // J has three digits, rounded up in the source
    EXPECT_LE(b.by_both, std::min(b.by_rate, b.by_amplitude));
    EXPECT_EQ(b.which(), "impulse");
  }
}

/// Remainder of an impulse of 1 N s after `after_s`, m: the contribution to the bound of a second pass at that time.
double left_of_an_impulse_m(const AxisLoop& loop, double after_s) {
  Disturbance passes = known(1, 1, 1, 1);
  passes.pass_period_s = after_s;
  passes.pass_length_s = 0;
  passes.passes = 2;
  const double both = disturbance_bounds(loop, Channel::kForce, passes).by_impulse;
  passes.passes = 1;
  return both - disturbance_bounds(loop, Channel::kForce, passes).by_impulse;
}

TEST(DisturbanceBounds, EarlierPassesAreStillFelt) {
  const AxisLoop z2 = pid_loop(10, 5, 2, kLag_s), z10 = pid_loop(10, 5, 10, kLag_s);
  EXPECT_NEAR(disturbance_bounds(z2, Channel::kForce, known(1, 1, 1, 1)).by_impulse, 4.686499723003938,
              1e-11);
  EXPECT_NEAR(left_of_an_impulse_m(z2, 4), .3356, 5e-5);
  EXPECT_NEAR(left_of_an_impulse_m(z2, 8.5), .1225, 5e-5);
  EXPECT_NEAR(left_of_an_impulse_m(z10, 4), .110, 5e-4);
  Disturbance passes = known(1, 1, 1, 0.02);
  passes.passes = 8;
  passes.pass_period_s = 4.5;
  passes.pass_length_s = 0.5;
  const DisturbanceBounds all = disturbance_bounds(z2, Channel::kForce, passes);
  passes.passes = 1;
  const DisturbanceBounds one = disturbance_bounds(z2, Channel::kForce, passes);
  EXPECT_NEAR(all.by_impulse / one.by_impulse, 1.12, 0.01);
}

/// h >= 0 with one hump: the best split cuts the hump off where its width is 2E/d (bang-bang with ramps of that
/// length).
TEST(DisturbanceBounds, AmplitudeAndRateTogetherHaveTheirClosedFormForOneHump) {
  const double a = 3, m = kMass_kg;
  const AxisLoop triple = pid_loop(3 * a * a, 3 * a, a * a * a);
  const double E = 1, d = 4;
  // h = t^2 e^(-at)/(2m). Finds the level c with width 2E/d by bisection.
  const auto h = [&](double t) { return t * t * std::exp(-a * t) / (2 * m); };
  const double peak = h(2 / a);
  double low = 0, high = peak, from = 0, to = 0;
  for (int i = 0; i < 200; ++i) {
    const double c = (low + high) / 2;
    double l = 0, r = 2 / a;
    for (int k = 0; k < 100; ++k) ((h((l + r) / 2) < c ? l : r) = (l + r) / 2);
    from = l;
    l = 2 / a, r = 60;
    for (int k = 0; k < 100; ++k) ((h((l + r) / 2) > c ? l : r) = (l + r) / 2);
    to = r;
    (to - from > 2 * E / d ? low : high) = c;
  }
  double above = 0;
  const int cells = 20000;
  for (int i = 0; i < cells; ++i)
    above += (h(from + (i + 0.5) * (to - from) / cells) - low) * (to - from) / cells;
  const double expected = 2 * E * low + d * above;
  const double found = amplitude_and_rate_bound(triple, Channel::kForce, E, d);
  EXPECT_NEAR(found, expected, 2e-4 * expected);
  EXPECT_GE(found, expected * (1 - 1e-7));
}

TEST(DisturbanceBounds, AmplitudeAndRateTogetherTendToEachAlone) {
  const AxisLoop loop = pid_loop(10, 5, 10, kLag_s);
  const GainNorms gains = continuous_norms(loop, Channel::kForce);
  EXPECT_NEAR(amplitude_and_rate_bound(loop, Channel::kForce, 1, 1e4), gains.amplitude,
              1e-2 * gains.amplitude);
  EXPECT_NEAR(amplitude_and_rate_bound(loop, Channel::kForce, 1e4, 1), gains.rate, 1e-6 * gains.rate);
  const double both = amplitude_and_rate_bound(loop, Channel::kForce, 1, 2);
  EXPECT_LT(both, 0.95 * std::min(gains.amplitude, 2 * gains.rate));
}

/// Ten thousand random forces of each class, each convolved with the kernel: none exceeds the bound of its class, and
/// the worst input of each class comes close to it.
TEST(DisturbanceBounds, NoneOfTenThousandRandomInputsOfEachClassExceedsItsBound) {
  const AxisLoop loop = pid_loop(10, 5, 10, kLag_s);
  const GainNorms gains = continuous_norms(loop, Channel::kForce);
  constexpr double kStep_s = 0.02;
  constexpr int kCount = 900;
  const std::vector<double> kernel =
      sampled_response(impulse_transfer(loop, Channel::kForce), kStep_s / 2, 2 * kCount);
  // A force that is constant on each step acts through the kernel's integral over the step (Simpson's rule).
  std::vector<double> weight(kCount);
  for (int i = 0; i < kCount; ++i) {
    const auto at = [&](int k) { return k < 2 * kCount ? kernel[static_cast<std::size_t>(k)] : 0; };
    weight[static_cast<std::size_t>(i)] = kStep_s / 6 * (at(2 * i) + 4 * at(2 * i + 1) + at(2 * i + 2));
  }
  const auto error = [&](const std::vector<double>& force) {
    double total = 0;
    for (std::size_t i = 0; i < force.size(); ++i) total += weight[force.size() - 1 - i] * force[i];
    return std::abs(total);
  };
  const double both = amplitude_and_rate_bound(loop, Channel::kForce, 1, 4);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<double> force(kCount);
  double nearest = 0;
  for (int run = 0; run < 10000; ++run) {
    const auto hold = static_cast<unsigned>(1 + random() % 200);
    double level = 0, value = 0;
    double rate = 0, variation = 0, impulse = 0, amplitude = 0, limited = 0, largest_step = 0;
    std::vector<double> slow(kCount);
    for (int i = 0; i < kCount; ++i) {
      if (static_cast<unsigned>(i) % hold == 0)
        level = run % 3 == 0 ? (unit(random) > 0 ? 1 : -1) : unit(random);
      const double before = value;
      value = level;
      variation += std::abs(value - before);
      largest_step = std::max(largest_step, std::abs(value - before));
      impulse += std::abs(value) * kStep_s;
      amplitude = std::max(amplitude, std::abs(value));
      force[static_cast<std::size_t>(i)] = value;
      limited += std::min(std::max(level - limited, -4 * kStep_s), 4 * kStep_s);
      slow[static_cast<std::size_t>(i)] = limited;
      rate = 4;
    }
    const double reached = error(force);
    ASSERT_LE(reached, gains.amplitude * amplitude + 1e-9);
    ASSERT_LE(reached, gains.edge * variation + 1e-9);
    ASSERT_LE(reached, gains.impulse * impulse + 1e-9);
    nearest = std::max(nearest, reached / (gains.amplitude * amplitude));
    // A staircase of rate-limited steps differs by at most one step from a force of that rate.
    const double slack = gains.amplitude * rate * kStep_s;
    ASSERT_LE(error(slow), gains.rate * rate + slack);
    ASSERT_LE(error(slow), both + slack);
  }
  EXPECT_GT(nearest, 0.6);
  // The worst force of amplitude 1 N has the sign of h'(T - t).
  std::vector<double> worst = sampled_response(impulse_transfer(loop, Channel::kForce), kStep_s, kCount);
  std::reverse(worst.begin(), worst.end());
  for (double& f : worst) f = f > 0 ? 1 : f < 0 ? -1 : 0;
  EXPECT_GE(error(worst), 0.998 * gains.amplitude);  // of 18 s
}

TEST(DisturbanceBounds, AStaircaseIsLateByItsPeriodAndItsLatency) {
  const GainNorms gains = {0, 5, 0, 0};
  EXPECT_DOUBLE_EQ(staircase_error(gains, 100, 0.004, 0.5), 5 * 0.014 * 0.5);
  EXPECT_EQ(staircase_error(gains, 0, 0, 0.5), 0);
}

TEST(DisturbanceBounds, AConstantErrorOfAnEstimateIsAddedToClassesThatDoNotContainIt) {
  const AxisLoop loop = {kMass_kg, 10, 5, 10, {1 / 17.4}, 0};
  const SampledLoop sampled = {loop, 0.01, 0.01};
  OtherErrors other;
  other.velocity_error.amplitude = 0.5;
  other.velocity_error.rate = 0.01;
  const double without_m = error_parts(loop, 1, other).velocity_error_m;
  const double sampled_m = error_parts(sampled, 1, other).velocity_error_m;
  other.velocity_error.constant = 0.1;
  EXPECT_NEAR(error_parts(loop, 1, other).velocity_error_m,
              without_m + 0.1 * continuous_norms(loop, Estimate::kVelocity).edge, 1e-12);
  EXPECT_NEAR(error_parts(sampled, 1, other).velocity_error_m,
              sampled_m + 0.1 * sampled_norms(sampled, Estimate::kVelocity, Instants::kAll).edge, 1e-12);
}

TEST(DisturbanceBounds, AMeasuredAmplitudeThatContainsTheBiasIsNotChargedTwice) {
  DisturbanceSource source;
  source.kind = "measured";
  for (int axis = 0; axis < 3; ++axis) {
    source.axis[axis].amplitude_N = 0.1;
    source.axis[axis].rate_N_s = 0.05;
    source.bias_N[axis] = 0.04;
  }
  EXPECT_TRUE(source.amplitudes_reach_bias());
  FlownLoop loop;
  loop.gains.pid = PidGains{{10, 10, 10}, {5, 5, 5}, {10, 10, 10}};
  loop.plant.mass_kg = kMass_kg;
  const ExactGains of = flown_gains(loop, 0, Channel::kForce);
  const GainNorms& gains = of.all_times;
  source.classes_contain_bias = true;
  const AxisBounds once = axis_bounds(loop, of, source, {});
  EXPECT_DOUBLE_EQ(once.bounds.by_amplitude, gains.amplitude * 0.1);
  EXPECT_DOUBLE_EQ(once.bounds.by_rate, gains.rate * 0.05 + gains.edge * 0.04)
      << "a rate does not contain it";
  source.classes_contain_bias = false;
  const AxisBounds beside = axis_bounds(loop, of, source, {});
  EXPECT_DOUBLE_EQ(beside.bounds.by_amplitude, gains.amplitude * 0.1 + gains.edge * 0.04);
  source.bias_N[1] = 0.2;
  EXPECT_FALSE(source.amplitudes_reach_bias()) << "no amplitude contains a larger bias";
}

}  // namespace
}  // namespace swarmcert::stability

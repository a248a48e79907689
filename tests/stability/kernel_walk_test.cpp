#include "stability/bounds/loops/kernel_walk.h"

#include <gtest/gtest.h>

#include "nn/base/random.h"
#include "stability/bounds/loops/kernel_sum.h"

namespace swarmcert::stability {
namespace {

/// A loop with or without integral, lags and delay.
SampledLoop random_loop(files::Random& random) {
  const auto between = [&](double low, double high) { return low * std::pow(high / low, random.uniform()); };
  SampledLoop loop;
  loop.plant.mass_kg = 1;
  loop.plant.Kp = between(1, 80);
  loop.plant.Kd = between(0.5, 25);
  loop.plant.Ki = random.uniform() < 0.3 ? 0 : between(0.01, 80);
  if (random.uniform() < 0.7) loop.plant.lags_s.push_back(between(0.005, 0.1));
  if (random.uniform() < 0.2) loop.plant.lags_s.push_back(0.05);
  if (random.uniform() < 0.2) loop.plant.delay_s = 0.06 * random.uniform();
  loop.period_s = 1 / between(15, 1000);
  loop.integrator_step_s = random.uniform() < 0.2 ? 0.002 : loop.period_s;
  return loop;
}

void expect_near(const GainNorms& by_strides, const GainNorms& by_periods, bool has_rate) {
  // Sums over many thousands of periods round, mostly those of the slowly decaying integral.
  constexpr double kRelative = 1e-9, kRelativeOfRate = 1e-7;
  if (has_rate) {
    EXPECT_NEAR(by_strides.rate, by_periods.rate, kRelativeOfRate * by_periods.rate);
  }
  EXPECT_NEAR(by_strides.amplitude, by_periods.amplitude, kRelative * by_periods.amplitude);
  EXPECT_NEAR(by_strides.edge, by_periods.edge, kRelative * by_periods.edge);
  EXPECT_NEAR(by_strides.impulse, by_periods.impulse, kRelative * by_periods.impulse);
}

/// Decaying, oscillating and lightly damped loops, whose last modes are a real one, a pair or several.
TEST(KernelWalk, SumsOverStridesAreThoseOverSinglePeriods) {
  files::Random random(3);
  int series = 0, pairs = 0, others = 0;
  for (int run = 0; run < 120; ++run) {
    const SampledLoop loop = random_loop(random);
    SCOPED_TRACE(run);
    const SampledAdjoint adjoint(loop);
    if (!adjoint.is_stable() || adjoint.periods() > 300'000) continue;
    (adjoint.ratio() > 0 ? series : adjoint.last_pair() ? pairs : others) += 1;
    const double phase_s = random.uniform() * loop.period_s;
    const Eigen::RowVectorXd output = adjoint.output_after_control(phase_s);
    KernelSum force, samples;
    const double h = loop.period_s;
    force.add_linear(0, 1, phase_s);
    adjoint.force_kernel(
        output, [&](double start, double slope, double length) { force.add_linear(start, slope, length); },
        [&](double start, double slope, double length, double ratio) {
          force.add_series(start, slope, length, ratio);
        });
    expect_near(force_gains(KernelWalk::of_force(adjoint), output, {phase_s}).front(), force.norms(),
                loop.plant.Ki > 0);
    double later = 1;
    adjoint.command_kernel(
        output, [&](double kernel) { samples.add_sample(kernel, h); },
        [&](double kernel, double ratio) {
          for (; later > 1e-18; later *= ratio) samples.add_sample(kernel * later, h);
        });
    expect_near(command_gains(adjoint, output), samples.norms(), loop.plant.Ki > 0);
  }
  EXPECT_GT(series, 5);
  EXPECT_GT(pairs, 5);
  EXPECT_GT(others, 0);
}

/// Most half cycles of such loops are not walked but repeat those before.
TEST(KernelWalk, HalfCyclesOfALightlyDampedLoopSumToThoseOfSinglePeriods) {
  files::Random random(5);
  int compared = 0;
  for (int run = 0; run < 400 && compared < 12; ++run) {
    SampledLoop loop = random_loop(random);
    loop.plant.Kd = 0.05 + 0.2 * random.uniform();
    loop.plant.lags_s.clear();
    const SampledAdjoint adjoint(loop);
    if (!adjoint.is_stable() || !adjoint.last_pair() || adjoint.periods() > 200'000) continue;
    const double half_cycles =
        static_cast<double>(adjoint.periods()) * std::arg(adjoint.last_pair()->mode) / 3.2;
    if (half_cycles < 200) continue;
    SCOPED_TRACE(run);
    ++compared;
    const Eigen::RowVectorXd output = adjoint.output_after_control(0);
    KernelSum single;
    single.add_linear(0, 1, 0);
    adjoint.force_kernel(
        output, [&](double start, double slope, double length) { single.add_linear(start, slope, length); },
        [](double, double, double, double) {});
    expect_near(force_gains(KernelWalk::of_force(adjoint), output, {0}).front(), single.norms(),
                loop.plant.Ki > 0);
  }
  EXPECT_EQ(compared, 12);
}

}  // namespace
}  // namespace swarmcert::stability

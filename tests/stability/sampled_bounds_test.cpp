#include "stability/bounds/sampled_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

constexpr int kParts = 4;  ///< parts of a period; a force is constant on each

SampledLoop loop_of(double Kp, double Kd, double Ki, double rate_hz, double step_s = 0) {
  return {{kMass_kg, Kp, Kd, Ki, {}, 0}, 1 / rate_hz, step_s > 0 ? step_s : 1 / rate_hz};
}

struct Reached {
  double error_m = 0, integral_m_s = 0;
};

/// Steps the loop of sampled_loop.h, without lag and delay, with a clamped integrator.
Reached fly(const SampledLoop& loop, const std::vector<double>& force_N, double limit_m_s = INFINITY) {
  const double h = loop.period_s / kParts, m = loop.plant.mass_kg;
  double p = 0, v = 0, integral = 0, command = 0;
  Reached reached;
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    if (i % kParts == 0) {
      integral = std::clamp(integral + loop.integrator_step_s * p, -limit_m_s, limit_m_s);
      command = -(loop.plant.Kp * p + loop.plant.Kd * v + loop.plant.Ki * integral);
      reached.integral_m_s = std::max(reached.integral_m_s, std::abs(integral));
    }
    const double a = command + force_N[i] / m;
    p += v * h + a * h * h / 2;
    v += a * h;
    reached.error_m = std::max(reached.error_m, std::abs(p));
  }
  return reached;
}

Disturbance of(double rate, double amplitude, double impulse) {
  Disturbance d;
  d.rate_N_s = rate;
  d.amplitude_N = amplitude;
  d.impulse_N_s = impulse;
  return d;
}

DisturbanceBounds bounds_of(const SampledLoop& loop, const Disturbance& d) {
  return disturbance_bounds(loop, Channel::kForce, sampled_norms(loop, Channel::kForce, Instants::kAll), d);
}

/// Levels between -1 and 1, held for random times.
std::vector<double> random_levels(std::mt19937& random, std::size_t count, bool bang) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto hold = static_cast<std::size_t>(4 + random() % 1200);
  std::vector<double> force(count);
  double level = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % hold == 0) level = bang ? (unit(random) > 0 ? 1 : -1) : unit(random);
    force[i] = level;
  }
  return force;
}

TEST(SampledBounds, NoRandomForceOfBoundedAmplitudeAndRateExceedsTheirBoundAndABangBangWithRampsComesNear) {
  for (const SampledLoop& loop :
       {loop_of(10, 5, 10, 100), loop_of(10, 5, 10, 100, 0.002), loop_of(7, 2, 3, 40)}) {
    SCOPED_TRACE(testing::Message() << loop.plant.Kp << " at " << 1 / loop.period_s << " Hz");
    const double E = 0.7, d = 1.5;
    const DisturbanceBounds bounds = bounds_of(loop, of(d, E, INFINITY));
    EXPECT_LT(bounds.by_both, 0.995 * std::min(bounds.by_rate, bounds.by_amplitude));
    std::mt19937 random(1);
    const double step = d * loop.period_s / kParts;
    const std::size_t count = static_cast<std::size_t>(25 / loop.period_s) * kParts;
    double nearest = 0;
    const auto limited = [&](const std::vector<double>& wanted) {
      double f = 0;
      std::vector<double> force;
      for (const double w : wanted) {
        // Half a step of the staircase above or below the ramp through it; included in the slack below.
        f += std::clamp(E * w - f, -step, step);
        force.push_back(f);
      }
      return force;
    };
    // A staircase differs from its ramp by at most a step.
    const double slack = bounds.by_amplitude / E * step;
    for (int run = 0; run < 300; ++run) {
      const double reached = fly(loop, limited(random_levels(random, count, run % 2 == 0))).error_m;
      ASSERT_LE(reached, bounds.by_both + slack);
      nearest = std::max(nearest, reached);
    }
    // Switching times of the pure amplitude problem, from the response to a pulse.
    std::vector<double> kernel;
    {
      const double h = loop.period_s / kParts;
      double p = 0, v = h / kMass_kg, integral = 0, command = 0;
      for (std::size_t i = 0; i < count; ++i) {
        if (i % kParts == 0) {
          integral += loop.integrator_step_s * p;
          command = -(loop.plant.Kp * p + loop.plant.Kd * v + loop.plant.Ki * integral);
        }
        p += v * h + command * h * h / 2;
        v += command * h;
        kernel.push_back(p);
      }
    }
    for (const double ahead_s : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}) {
      std::vector<double> wanted(count);
      const auto ahead = static_cast<std::size_t>(ahead_s / loop.period_s * kParts);
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t back = count - 1 - i;
        wanted[i] = kernel[back >= ahead ? back - ahead : 0] > 0 ? 1 : -1;
      }
      nearest = std::max(nearest, fly(loop, limited(wanted)).error_m);
    }
    EXPECT_GT(nearest, 0.95 * bounds.by_both);
  }
}

TEST(SampledBounds, AmplitudeAndRateTogetherTendToTheContinuousLoopAndToEachAlone) {
  const SampledLoop fast = loop_of(10, 5, 10, 2000);
  EXPECT_NEAR(bounds_of(fast, of(2, 1, INFINITY)).by_both,
              amplitude_and_rate_bound(fast.plant, Channel::kForce, 1, 2), 2e-3 * 5);
  const SampledLoop loop = loop_of(10, 5, 10, 100);
  const GainNorms gains = sampled_norms(loop, Channel::kForce, Instants::kAll);
  EXPECT_NEAR(bounds_of(loop, of(1e5, 1, INFINITY)).by_both, gains.amplitude, 1e-3 * gains.amplitude);
  EXPECT_NEAR(bounds_of(loop, of(1, 1e5, INFINITY)).by_both, gains.rate, 1e-6 * gains.rate);
  for (const double d : {0.3, 1.0, 5.0}) {
    const DisturbanceBounds command = disturbance_bounds(
        loop, Channel::kCommand, sampled_norms(loop, Channel::kCommand, Instants::kAll), of(d, 1, INFINITY));
    EXPECT_NEAR(command.by_both, bounds_of(loop, of(d, 1, INFINITY)).by_both, 0.02 * command.by_both);
  }
}

TEST(SampledBounds, PassesAreFeltAsOftenAsTheyComeAndNoTrainOfThemExceedsTheBound) {
  const SampledLoop loop = loop_of(10, 5, 10, 100, 0.002);
  Disturbance train = of(INFINITY, INFINITY, 0.02);
  train.passes = 4;
  train.pass_period_s = 1.0;
  train.pass_length_s = 0.3;
  const double bound = bounds_of(loop, train).by_impulse;
  Disturbance one = train;
  one.passes = 1;
  EXPECT_GT(bound, 1.2 * bounds_of(loop, one).by_impulse);
  EXPECT_LT(bound, 4 * bounds_of(loop, one).by_impulse);
  std::mt19937 random(5);
  double most = 0;
  for (int run = 0; run < 400; ++run) {
    std::vector<double> force(400 * kParts * 2, 0.0);
    for (int pass = 0; pass < 4; ++pass) {
      const std::size_t length = 1 + random() % (29 * kParts);
      const std::size_t start =
          static_cast<std::size_t>(pass) * 100 * kParts + random() % (30 * kParts - length);
      const double f = 0.02 / (static_cast<double>(length) * loop.period_s / kParts);
      for (std::size_t i = 0; i < length; ++i) force[start + i] = random() % 9 == 0 ? -f : f;
    }
    most = std::max(most, fly(loop, force).error_m);
  }
  EXPECT_LE(most, bound);
  EXPECT_GT(most, 0.6 * bound);
}

/// Many passes of a loop with a slow mode, long after all others have decayed: close to those of the continuous loop.
TEST(SampledBounds, PassesFadeWithTheSlowestMode) {
  const SampledLoop loop = loop_of(20, 10, 3, 1000);
  Disturbance train = of(INFINITY, 0.1, 0.02);
  train.variation_N = 0.2;
  train.variation_per_pass = true;
  train.passes = Disturbance::kManyPasses;
  train.pass_period_s = train.pass_length_s = 4.5;
  const DisturbanceBounds sampled = bounds_of(loop, train);
  const DisturbanceBounds continuous = disturbance_bounds(loop.plant, Channel::kForce, train);
  EXPECT_NEAR(sampled.by_impulse, continuous.by_impulse, 0.02 * continuous.by_impulse);
  EXPECT_NEAR(sampled.by_edges, continuous.by_edges, 0.02 * continuous.by_edges);
}

/// The firmware's clamp: both bounds that hold with it, its demand, and whether it acts.
TEST(SampledBounds, NoForceDrivesAClampedLoopBeyondItsBounds) {
  const double E = 0.1;
  for (const double limit_m_s : {0.01, 0.05, 0.4}) {
    const SampledLoop loop = loop_of(10, 5, 10, 100, 0.002);
    const ClampBounds clamp = clamp_bounds(loop, Channel::kForce, of(INFINITY, E, INFINITY), {}, limit_m_s);
    const double linear = sampled_norms(loop, Channel::kForce, Instants::kAll).amplitude * E;
    const double bound = clamp.never_acts ? std::min(linear, clamp.by_amplitude) : clamp.by_amplitude;
    std::mt19937 random(8);
    double demanded = 0, acted = 0;
    for (int run = 0; run < 400; ++run) {
      std::vector<double> force = random_levels(random, 4000 * kParts, run % 2 == 0);
      for (double& f : force) f *= E;
      ASSERT_LE(fly(loop, force, limit_m_s).error_m, bound) << limit_m_s;
      demanded = std::max(demanded, fly(loop, force).integral_m_s);
      acted += demanded > limit_m_s;
    }
    EXPECT_LE(demanded, clamp.demand_m_s);
    EXPECT_GT(demanded, 0.6 * clamp.demand_m_s);
    EXPECT_EQ(acted > 0, !clamp.never_acts) << limit_m_s;
  }
}

TEST(SampledBounds, AClampedBiasIsCounted) {
  const SampledLoop loop = loop_of(10, 5, 10, 100);
  const double bias_N = 0.0883, limit_m_s = 0.1;
  const ClampBounds clamp =
      clamp_bounds(loop, Channel::kForce, of(INFINITY, 0, INFINITY), {bias_N}, limit_m_s);
  EXPECT_FALSE(clamp.never_acts);
  const std::vector<double> force(6000 * kParts, bias_N);
  // The integral settles where it cancels the bias, and overshoots on the way.
  EXPECT_GT(clamp.demand_m_s, 1.01 * bias_N / (kMass_kg * 10));
  EXPECT_NEAR(clamp.demand_m_s, fly(loop, force).integral_m_s, 1e-6);
  const double reached = fly(loop, force, limit_m_s).error_m;
  EXPECT_GE(reached, clamp_residual(loop.plant, bias_N, limit_m_s) * 0.999);
  EXPECT_LE(reached, clamp.by_amplitude);
}

}  // namespace
}  // namespace swarmcert::stability

#include "stability/checker/gain_bounds.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "stability/checker/sampled_gain_bounds.h"

namespace swarmcert::check {
namespace {

/// Both poles at -2 and no integral: the response to an impulse of force is t e^(-2t)/m. In time units of 1/2 s the
/// companion matrix is [0 1; -1 -2], and A'P + PA = -I.
LoopWitness double_pole() {
  LoopWitness loop;
  loop.input = "force";
  loop.mass_kg = 0.5, loop.Kp = 4, loop.Kd = 4;
  loop.time_exponent = 1, loop.step_exponent = 6, loop.steps = 1500;
  loop.decay = 0.25;
  loop.P = {{1.5, 0.5}, {0.5, 0.5}};
  return loop;
}

TEST(GainBounds, LieJustAboveTheClosedForm) {
  const GainBounds gains = upper_gains(double_pole());
  const auto is_just_above = [](const mpq_class& bound, double exact) {
    EXPECT_GE(bound.get_d(), exact * (1 - 1e-15));
    EXPECT_LE(bound.get_d(), exact * 1.001);
  };
  EXPECT_FALSE(gains.rate.has_value());
  is_just_above(gains.amplitude, 1 / (4 * 0.5));
  is_just_above(gains.edge, 1 / (4 * 0.5));
  is_just_above(gains.impulse, std::exp(-1.0) / (2 * 0.5));
}

TEST(GainBounds, RemainBoundsWhereTheTailBeginsEarly) {
  LoopWitness loop = double_pole();
  loop.steps = 30;
  const GainBounds early = upper_gains(loop);
  EXPECT_GE(early.amplitude, mpq_class(1, 2));
  EXPECT_GE(early.edge, mpq_class(1, 2));
  EXPECT_GE(early.impulse.get_d(), std::exp(-1.0));
}

TEST(GainBounds, RefuseAWitnessThatShowsNothing) {
  const auto refuses = [](auto change) {
    LoopWitness loop = double_pole();
    change(loop);
    EXPECT_THROW(upper_gains(loop), std::runtime_error);
  };
  refuses([](LoopWitness& loop) { loop.decay = 0.3; });  // 2 decay P exceeds I
  refuses([](LoopWitness& loop) { loop.P[0][0] = -1.5; });
  refuses([](LoopWitness& loop) { loop.P[0][1] = 0.4; });
  refuses([](LoopWitness& loop) { loop.P.pop_back(); });
  refuses([](LoopWitness& loop) { loop.P[1].push_back(1); });
  refuses([](LoopWitness& loop) { loop.step_exponent = 2; });  // cells of 1/4, where |A| is 3
  refuses([](LoopWitness& loop) { loop.steps = 0; });
  refuses([](LoopWitness& loop) { loop.steps = 1L << 40; });
  refuses([](LoopWitness& loop) { loop.Kp = -4; });
  refuses([](LoopWitness& loop) { loop.mass_kg = std::nan(""); });
  refuses([](LoopWitness& loop) { loop.input = "torque"; });
  refuses([](LoopWitness& loop) { loop.lags_s = {0.01}; });  // P has the wrong size
}

/// Without lags and integral: (e, e') of the next period is M (e, e') with M = [1/2 1/4; -2 0], of spectral radius
/// sqrt(1/2).
SampledWitness held_pole() {
  SampledWitness loop;
  loop.mass_kg = 0.5, loop.Kp = 4, loop.Kd = 2;
  loop.period_s = loop.integrator_step_s = 0.5;
  loop.steps = 60;
  loop.contraction = 0.875;
  const std::vector<std::vector<double>> M = period_map(loop);
  // P = sum_k (M/0.8)^k (M'/0.8)^k, rounded to multiples of 2^-20.
  std::array<std::array<double, 2>, 2> power = {{{1, 0}, {0, 1}}}, P = {};
  for (int k = 0; k < 200; ++k) {
    std::array<std::array<double, 2>, 2> next = {};
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t j = 0; j < 2; ++j) {
        P[i][j] += power[i][0] * power[j][0] + power[i][1] * power[j][1];
        next[i][j] = (M[i][0] * power[0][j] + M[i][1] * power[1][j]) / 0.8;
      }
    power = next;
  }
  for (const auto& row : P) {
    loop.P.emplace_back();
    for (const double x : row) loop.P.back().push_back(std::ldexp(std::round(std::ldexp(x, 20)), -20));
  }
  return loop;
}

TEST(SampledGainBounds, FollowTheMapWrittenDownByHand) {
  const std::vector<std::vector<double>> expected = {{0.5, 0.25}, {-2, 0}};
  const std::vector<std::vector<double>> M = period_map(held_pole());
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t j = 0; j < 2; ++j) EXPECT_NEAR(M[i][j], expected[i][j], 1e-15);
}

TEST(SampledGainBounds, LieJustAboveSumsOverThePeriods) {
  const SampledWitness loop = held_pole();
  const SampledGainBounds gains = sampled_upper_gains(loop);
  // An error of 1 N in one command acts for one period: (e, e') = (1/8, 1/2)/mass after it.
  double e = 0.125 / 0.5, v = 0.5 / 0.5, sum = 0, step = 0, peak = 0, largest = 0;
  for (int k = 0; k < 200; ++k) {
    sum += std::abs(e), step += e;
    peak = std::max(peak, std::abs(step)), largest = std::max(largest, std::abs(e));
    const double next = 0.5 * e + 0.25 * v;
    v = -2 * e;
    e = next;
  }
  EXPECT_NEAR(step, 1 / (4 * 0.5), 1e-12) << "the error that a constant command of 1 N leaves";
  // The excess between the sampling times is at most period^2/8 = 1/32 of the largest acceleration.
  const auto is_above = [](const mpq_class& bound, double at_samples) {
    EXPECT_GE(bound.get_d(), at_samples);
    EXPECT_LE(bound.get_d(), 1.7 * at_samples);
  };
  EXPECT_FALSE(gains.command.rate.has_value());
  is_above(gains.command.amplitude, sum);
  is_above(gains.command.edge, peak);
  is_above(gains.command.impulse, largest / 0.5);
  EXPECT_GE(gains.force.amplitude, gains.command.amplitude) << "a force may change within a period";
}

TEST(SampledGainBounds, RemainBoundsWhereTheTailBeginsEarly) {
  SampledWitness loop = held_pole();
  const SampledGainBounds full = sampled_upper_gains(loop);
  loop.steps = 3;
  const SampledGainBounds early = sampled_upper_gains(loop);
  EXPECT_GT(early.force.amplitude, full.force.amplitude);
  EXPECT_GE(early.velocity.edge, full.velocity.edge);
}

TEST(SampledGainBounds, RefuseAWitnessThatShowsNothing) {
  const auto refuses = [](auto change) {
    SampledWitness loop = held_pole();
    change(loop);
    EXPECT_THROW(sampled_upper_gains(loop), std::runtime_error);
  };
  refuses([](SampledWitness& loop) { loop.contraction = 0.7; });  // the spectral radius is 0.7071
  refuses([](SampledWitness& loop) { loop.contraction = 1; });
  refuses([](SampledWitness& loop) { loop.P[0][0] = -1; });
  refuses([](SampledWitness& loop) { loop.P[0][1] += 0.5; });
  refuses([](SampledWitness& loop) { loop.P.pop_back(); });
  refuses([](SampledWitness& loop) { loop.steps = 0; });
  refuses([](SampledWitness& loop) { loop.period_s = 0; });
  refuses([](SampledWitness& loop) { loop.period_s = 2; });  // unstable
  refuses([](SampledWitness& loop) { loop.delay_s = 5; });   // ten past commands
  refuses([](SampledWitness& loop) { loop.lags_s = {1e-6}; });
  refuses([](SampledWitness& loop) { loop.Ki = 1; });  // P has the wrong size
}

}  // namespace
}  // namespace swarmcert::check

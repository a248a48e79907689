// The bound for forces limited in amplitude and in rate, compared with each limit alone and with forces of the class.
#include "stability/bounds/amplitude_and_rate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nn/base/random.h"
#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {
namespace {

constexpr double kNodeStep_s = 0.002;
constexpr int kNumNodes = 7501;  // 15 s

/// y = 1.5 exp(-t) - 5 exp(-2 t) + 3.5 exp(-3 t): starts at zero, changes its sign once, then decays to zero.
StepResponse response() {
  StepResponse h;
  h.value = sampled_response({{1, -2}, {6, 11, 6, 1}}, kNodeStep_s, kNumNodes);
  h.length.assign(h.value.size() - 1, kNodeStep_s);
  // |y''|; y less its chord integrates to at most step^3 / 12 of it.
  const double largest_bend = 1.5 + 5 * 4 + 3.5 * 9;
  h.bend.assign(h.length.size(), largest_bend * kNodeStep_s * kNodeStep_s * kNodeStep_s / 12);
  h.after = std::abs(h.value.back());  // of exp(-t), which dominates there
  h.falls_after = true;
  return h;
}

double variation(const StepResponse& h) {
  double sum = 0;
  for (std::size_t i = 1; i < h.value.size(); ++i) sum += std::abs(h.value[i] - h.value[i - 1]);
  return sum + std::abs(h.value.back());
}

/// Largest contribution of the bends of all cells to any bound.
double bends(const StepResponse& h) { return std::accumulate(h.bend.begin(), h.bend.end(), 0.0); }

double integral(const StepResponse& h) {
  double sum = h.after;
  for (std::size_t i = 1; i < h.value.size(); ++i)
    sum += h.length[i - 1] * (std::abs(h.value[i]) + std::abs(h.value[i - 1])) / 2;
  return sum;
}

TEST(AmplitudeAndRate, BoundIsAtMostThatOfEachLimitAloneAndReachesItWhereTheOtherIsLoose) {
  const StepResponse h = response();
  const double by_amplitude = variation(h), by_rate = integral(h);
  for (const double amplitude : {0.01, 0.1, 1.0, 10.0}) {
    for (const double rate : {0.01, 0.1, 1.0, 10.0}) {
      const double bound = split_bound(h, amplitude, rate);
      EXPECT_LE(bound, (amplitude * by_amplitude + rate * bends(h)) * 1.001);
      EXPECT_LE(bound, rate * (by_rate + bends(h)) * 1.001);
    }
  }
  EXPECT_NEAR(split_bound(h, 1, 100), by_amplitude + 100 * bends(h), 0.01 * by_amplitude);
  EXPECT_NEAR(split_bound(h, 100, 1), by_rate + bends(h), 0.01 * by_rate);
}

TEST(AmplitudeAndRate, NoForceOfTheClassExceedsTheBoundAndTheBestComeNear) {
  // The output at the end under f is sum over cells of h(end - t) f'(t) dt: h is the response to a step of f.
  const StepResponse h = response();
  files::Random random(5);
  const double amplitude = 0.5, rate = 0.4, bound = split_bound(h, amplitude, rate);
  double largest = 0;
  for (int run = 0; run < 200; ++run) {
    // Follows the sign of the remaining response with a random lead, as far as both limits allow.
    const auto lead = static_cast<std::size_t>(1500 * random.uniform());
    double f = 0, output = 0;
    for (std::size_t i = 0; i + 1 < h.value.size(); ++i) {
      const std::size_t ahead = h.value.size() - 1 - i;  // h(end - t)
      const double wanted = h.value[ahead - std::min(ahead, lead)] > 0 ? amplitude : -amplitude;
      const double next = std::clamp(wanted, f - rate * kNodeStep_s, f + rate * kNodeStep_s);
      output += (h.value[ahead] + h.value[ahead - 1]) / 2 * (next - f);
      f = next;
    }
    largest = std::max(largest, std::abs(output));
  }
  EXPECT_LE(largest, bound);
  EXPECT_GT(largest, 0.5 * bound);
}

}  // namespace
}  // namespace swarmcert::stability

// Kernels cell by cell, compared with the verified norms of the whole response and with responses by exact recursion.
#include "stability/bounds/enclosures/kernel_cells.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nn/base/random.h"
#include "stability/bounds/enclosures/verified_norms.h"
#include "stability/bounds/loops/axis_loop.h"
#include "stability/enclosure.h"

namespace swarmcert::stability {
namespace {

/// Loops of axis_loop_test.cpp: Z 10/5/10 and Z 10/5/2 behind a motor lag, A1 (triple pole).
const AxisLoop kLoops[] = {
    {0.034, 10, 5, 10, {1 / 17.4}, 0}, {0.034, 10, 5, 2, {1 / 17.4}, 0}, {0.034, 48, 12, 64, {}, 0}};

TEST(KernelCells, SumUpToTheVerifiedNormsFromAbove) {
  for (const AxisLoop& loop : kLoops) {
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      const auto norms = verified_norms(loop, channel);
      const auto h = tests::cells_of(step_transfer(loop, channel), 0.025, 2400);
      const auto h1 = tests::cells_of(impulse_transfer(loop, channel), 0.025, 2400);
      ASSERT_TRUE(norms && h && h1);
      const auto expect_above = [](double value, Interval exact) {
        EXPECT_GE(value, exact.lower * (1 - 1e-4));  // the cells cover 60 s
        EXPECT_LE(value, exact.upper * (1 + 2e-4));
      };
      expect_above(h->total(), norms->rate);
      expect_above(h1->total(), norms->amplitude);
      EXPECT_GE(h->peak, norms->edge.lower);
      EXPECT_LE(h->peak, norms->edge.upper * (1 + 2e-4));
      EXPECT_GE(h1->peak, norms->impulse.lower);
      EXPECT_LE(h1->peak, norms->impulse.upper * (1 + 1e-3));
    }
  }
}

TEST(KernelCells, EveryCellIsAtLeastTheFineSumOfItsResponse) {
  for (const AxisLoop& loop : kLoops) {
    const TransferFunction y = impulse_transfer(loop, Channel::kForce);
    const auto cells = tests::cells_of(y, 0.05, 100);
    ASSERT_TRUE(cells);
    const int parts = 500;
    const std::vector<double> values = sampled_response(y, 0.05 / parts, 100 * parts + 1);
    for (int k = 0; k < 100; ++k) {
      double sum = 0;
      double net = 0;
      for (int i = 0; i < parts; ++i) {
        const auto at = static_cast<std::size_t>(k * parts + i);
        sum += (std::abs(values[at]) + std::abs(values[at + 1])) / 2 * 0.05 / parts;
        net += (values[at] + values[at + 1]) / 2 * 0.05 / parts;
      }
      const Interval& in_cell = cells->net[static_cast<std::size_t>(k)];
      ASSERT_GE(net, in_cell.lower - 1e-5 * sum);
      ASSERT_LE(net, in_cell.upper + 1e-5 * sum);
      ASSERT_LE(in_cell.upper - in_cell.lower, 3e-5 * cells->total());
      ASSERT_GE(cells->integral[static_cast<std::size_t>(k)], sum * (1 - 1e-5));
      ASSERT_LE(cells->integral[static_cast<std::size_t>(k)], sum + 2e-5 * cells->total());
    }
  }
}

TEST(KernelCells, NoErrorUnderRandomForcesOfTheSizesExceedsTheConvolution) {
  files::Random random(4);
  const TransferFunction y = impulse_transfer(kLoops[0], Channel::kForce);
  const int cells = 80;
  const int parts = 25;
  const auto kernel = tests::cells_of(y, 0.025, cells);
  ASSERT_TRUE(kernel);
  const std::vector<double> h = sampled_response(y, 0.001, cells * parts + 1);
  double nearest = 0;
  for (int run = 0; run < 40; ++run) {
    std::vector<double> sizes;
    for (int k = 0; k < cells; ++k) sizes.push_back(random.uniform() * (k / 10 % 2 == run % 2 ? 1 : 0.1));
    const std::vector<double> bound = convolved(*kernel, sizes);
    // The worst force for the error at the end of cell n, and one with random signs.
    const int n = 20 + static_cast<int>(random.below(60));
    const int end = (n + 1) * parts - 1;
    for (const bool worst : {true, false}) {
      double error = 0;
      for (int i = 0; i < end; ++i) {
        const double kernel_at =
            (h[static_cast<std::size_t>(end - i)] + h[static_cast<std::size_t>(end - i - 1)]) / 2;
        const double sign = worst ? (kernel_at >= 0 ? 1 : -1) : (random.below(2) == 0 ? 1 : -1);
        error += kernel_at * sign * sizes[static_cast<std::size_t>(i / parts)] * 0.001;
      }
      ASSERT_LE(std::abs(error), bound[static_cast<std::size_t>(n)]);
      nearest = std::max(nearest, std::abs(error) / bound[static_cast<std::size_t>(n)]);
    }
  }
  EXPECT_GT(nearest, 0.6) << "the worst force must come near";
}

/// Number of responses to signals within intervals that lie outside the kernel's enclosure, and the largest fraction of
/// its width that they use.
struct Outside {
  int count = 0;
  double widest = 0;
};

Outside outside(const KernelCells& kernel, const std::vector<double>& y, double step_s, int parts) {
  files::Random random(9);
  const int cells = static_cast<int>(kernel.integral.size());
  Outside result;
  for (int run = 0; run < 60; ++run) {
    std::vector<Interval> w;
    for (int k = 0; k < cells; ++k) {
      const double middle = std::sin(0.07 * k + run) + random.symmetric() * 0.1;
      const double half = 0.2 * random.uniform();
      w.emplace_back(middle - half, middle + half);
    }
    const auto n = static_cast<std::size_t>(20 + random.below(static_cast<std::uint64_t>(cells - 20)));
    const Interval answered = answer_to_past(kernel, w, n) + answer(kernel, 0, hull(w[n], w[n - 1]));
    // At any time in cell n; the signals that drive the response furthest down and up.
    const int end =
        static_cast<int>(n) * parts + 1 + static_cast<int>(random.below(static_cast<std::uint64_t>(parts)));
    double reached[2] = {0, 0};
    for (int i = 0; i < end; ++i) {
      const double y_at =
          (y[static_cast<std::size_t>(end - i)] + y[static_cast<std::size_t>(end - i - 1)]) / 2;
      const Interval& range = w[static_cast<std::size_t>(i / parts)];
      reached[0] += y_at * (y_at >= 0 ? range.lower : range.upper) * step_s;
      reached[1] += y_at * (y_at >= 0 ? range.upper : range.lower) * step_s;
    }
    if (reached[0] < answered.lower || reached[1] > answered.upper) ++result.count;
    result.widest = std::max(result.widest, (reached[1] - reached[0]) / (answered.upper - answered.lower));
  }
  return result;
}

TEST(KernelCells, NoResponseToSignalsWithinIntervalsLeavesWhatTheyAnswer) {
  for (const AxisLoop& loop : kLoops) {
    const TransferFunction y = impulse_transfer(loop, Channel::kCommand);
    const int parts = 25;
    const auto kernel = tests::cells_of(y, 0.025, 120);
    ASSERT_TRUE(kernel);
    const std::vector<double> values = sampled_response(y, 0.001, 120 * parts + 1);
    const Outside found = outside(*kernel, values, 0.001, parts);
    EXPECT_EQ(found.count, 0);
    EXPECT_GT(found.widest, 0.4);
    // The same test for wrong kernels: too small, shifted by a cell, with the wrong sign.
    KernelCells small = *kernel;
    for (double& x : small.integral) x *= 0.3;
    KernelCells late = *kernel;
    late.net.insert(late.net.begin(), 4, Interval(0));
    KernelCells negative = *kernel;
    for (Interval& x : negative.net) x = -x;
    for (const KernelCells* broken : {&small, &late, &negative})
      EXPECT_GT(outside(*broken, values, 0.001, parts).count, 0);
  }
}

TEST(KernelCells, UnstableLoopsHaveNone) {
  AxisLoop loop = kLoops[0];
  loop.lags_s = {0.5};  // Routh: at most 0.4 s
  EXPECT_FALSE(tests::cells_of(impulse_transfer(loop, Channel::kForce), 0.025, 10));
}

}  // namespace
}  // namespace swarmcert::stability

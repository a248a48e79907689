// Kernels cell by cell against the verified norms of the whole and against responses by exact recursion.
#include "stability/bounds/kernel_cells.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nn/files/random.h"
#include "stability/bounds/axis_loop.h"
#include "stability/bounds/verified_norms.h"

namespace swarmcert::stability {
namespace {

/// stability.md 2.1: Z 10/5/10 and Z 10/5/2 behind a motor, A1 (triple pole).
const AxisLoop kLoops[] = {
    {0.034, 10, 5, 10, {1 / 17.4}, 0}, {0.034, 10, 5, 2, {1 / 17.4}, 0}, {0.034, 48, 12, 64, {}, 0}};

TEST(KernelCells, SumUpToTheVerifiedNormsFromAbove) {
  for (const AxisLoop& loop : kLoops) {
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      const auto norms = verified_norms(loop, channel);
      const auto h = kernel_cells(step_transfer(loop, channel), 0.025, 2400);
      const auto h1 = kernel_cells(impulse_transfer(loop, channel), 0.025, 2400);
      ASSERT_TRUE(norms && h && h1);
      const auto expect_above = [](double value, Interval exact) {
        EXPECT_GE(value, exact.lo * (1 - 1e-4));  // 60 s of it
        EXPECT_LE(value, exact.hi * (1 + 2e-4));
      };
      expect_above(h->total(), norms->rate);
      expect_above(h1->total(), norms->amplitude);
      EXPECT_GE(h->peak, norms->edge.lo);
      EXPECT_LE(h->peak, norms->edge.hi * (1 + 2e-4));
      EXPECT_GE(h1->peak, norms->impulse.lo);
      EXPECT_LE(h1->peak, norms->impulse.hi * (1 + 1e-3));
    }
  }
}

TEST(KernelCells, EveryCellIsAtLeastTheFineSumOfItsResponse) {
  for (const AxisLoop& loop : kLoops) {
    const TransferFunction y = impulse_transfer(loop, Channel::kForce);
    const auto cells = kernel_cells(y, 0.05, 100);
    ASSERT_TRUE(cells);
    const int parts = 500;
    const std::vector<double> values = sampled_response(y, 0.05 / parts, 100 * parts + 1);
    for (int k = 0; k < 100; ++k) {
      double sum = 0;
      for (int i = 0; i < parts; ++i) {
        const auto at = static_cast<std::size_t>(k * parts + i);
        sum += (std::abs(values[at]) + std::abs(values[at + 1])) / 2 * 0.05 / parts;
      }
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
  const auto kernel = kernel_cells(y, 0.025, cells);
  ASSERT_TRUE(kernel);
  const std::vector<double> h = sampled_response(y, 0.001, cells * parts + 1);
  double nearest = 0;
  for (int run = 0; run < 40; ++run) {
    std::vector<double> sizes;
    for (int k = 0; k < cells; ++k) sizes.push_back(random.uniform() * (k / 10 % 2 == run % 2 ? 1 : 0.1));
    const std::vector<double> bound = convolved(*kernel, sizes);
    // The worst force for the error at the end of cell n, and one of random signs.
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

TEST(KernelCells, UnstableLoopsAndDelaysHaveNone) {
  AxisLoop loop = kLoops[0];
  loop.lags_s = {0.5};  // Routh: at most 0.4 s
  EXPECT_FALSE(kernel_cells(impulse_transfer(loop, Channel::kForce), 0.025, 10));
  loop = kLoops[0];
  loop.delay_s = 0.01;
  EXPECT_FALSE(kernel_cells(impulse_transfer(loop, Channel::kForce), 0.025, 10));
}

}  // namespace
}  // namespace swarmcert::stability

// Kernels of all lags of an interval, compared with responses of single lags by exact recursion.
#include "stability/bounds/enclosures/lag_range_cells.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nn/base/random.h"
#include "stability/enclosure.h"

namespace swarmcert::stability {
namespace {

constexpr double kCell_s = 0.025;
constexpr int kCells = 120, kFine = 100;

/// Y_tau = (n + tau n')/(d + tau d').
struct Family {
  Polynomial n, n_per_lag, d, d_per_lag;

  TransferFunction with(double tau_s) const {
    return {sum(n, scaled(n_per_lag, tau_s)), sum(d, scaled(d_per_lag, tau_s)), {}, 0};
  }
  std::optional<KernelCells> cells(Interval lag_s) const {
    const auto interval = [](const Polynomial& p) { return IntervalVector(p.begin(), p.end()); };
    return LagRangeCells(interval(d), interval(d_per_lag), lag_s, kCell_s, kCells)
        .cells(interval(n), interval(n_per_lag));
  }
};

/// s^4 tau + s^3 + 5 s^2 + 10 s + 10, and the same with an additional lag of 0.1 s: h' and g' of axis_loop.h for 1 kg.
const Polynomial kOne = {10, 10, 5, 1}, kTwo = {10, 10, 5, 1, 0.1};
const Family kFamilies[] = {{{0, 1}, {}, kOne, {0, 0, 0, 0, 1}},
                            {{}, {0, 0, 1}, kOne, {0, 0, 0, 0, 1}},
                            {{0, 1}, {}, kTwo, {0, 0, 0, 0, 1, 0.1}},
                            {{0, 0, 0.1}, {0, 0, 1, 0.1}, kTwo, {0, 0, 0, 0, 1, 0.1}}};
const Interval kLags_s(0.05, 0.065);

TEST(LagRangeCells, ContainTheResponseOfEveryLagOfTheInterval) {
  files::Random random(5);
  for (const Family& family : kFamilies) {
    const auto cells = family.cells(kLags_s);
    ASSERT_TRUE(cells);
    for (int trial = 0; trial < 12; ++trial) {
      const double x = trial < 2 ? 2 * trial - 1 : random.symmetric();
      const double tau_s = 0.0575 + 0.0075 * x;
      SCOPED_TRACE(tau_s);
      const std::vector<double> y = sampled_response(family.with(tau_s), kCell_s / kFine, kCells * kFine + 1);
      for (std::size_t k = 0; k < kCells; ++k) {
        double sum = 0, net = 0, largest = 0;
        for (std::size_t i = k * kFine; i < (k + 1) * kFine; ++i) {
          sum += (std::abs(y[i]) + std::abs(y[i + 1])) / 2 * kCell_s / kFine;
          net += (y[i] + y[i + 1]) / 2 * kCell_s / kFine;
          largest = std::max(largest, std::abs(y[i]));
        }
        const double rounding = 1e-5 * sum;  // of the trapezoidal sums
        ASSERT_LE(sum - rounding, cells->integral[k]) << k;
        ASSERT_LE(largest, cells->largest[k]) << k;
        const double by_lag = x * cells->modes[0][k] + (2 * x * x - 1) * cells->modes[1][k];
        ASSERT_GE(net + rounding, cells->net[k].lower + by_lag) << k;
        ASSERT_LE(net - rounding, cells->net[k].upper + by_lag) << k;
      }
    }
  }
}

TEST(LagRangeCells, AreLittleLargerThanThoseOfTheWorstLag) {
  for (const Family& family : kFamilies) {
    const auto cells = family.cells(kLags_s);
    const auto least = family.cells(kLags_s.lower), most = family.cells(kLags_s.upper);
    ASSERT_TRUE(cells && least && most);
    const double worst = std::max(least->total(), most->total());
    EXPECT_GE(cells->total(), worst);
    EXPECT_LE(cells->total(), 1.05 * worst);
    // The remainder of the nets after the modes is small compared with the change due to the lag.
    double left = 0, moved = 0;
    for (std::size_t k = 0; k < kCells; ++k) {
      left += cells->net[k].upper - cells->net[k].lower;
      moved += 2 * std::abs(cells->modes[0][k]);
    }
    EXPECT_GT(moved, 0.02 * worst);
    EXPECT_LT(left, 0.01 * worst);
  }
}

TEST(LagRangeCells, OfOneLagAreThoseOfItsTransferFunction) {
  for (const Family& family : kFamilies) {
    const auto one = family.cells(0.0575);
    const auto plain = tests::cells_of(family.with(0.0575), kCell_s, kCells);
    ASSERT_TRUE(one && plain);
    EXPECT_TRUE(one->modes.empty());
    EXPECT_NEAR(one->total(), plain->total(), 1e-9 * plain->total());
    EXPECT_NEAR(one->peak, plain->peak, 1e-9 * plain->peak);
  }
}

TEST(LagRangeCells, AnIntervalWithLagsOfUnstableLoopsHasNone) {
  // The loop is stable below (Kd - Ki/Kp)/Kp = 0.4 s.
  EXPECT_TRUE(kFamilies[0].cells({0.3, 0.35}));
  EXPECT_FALSE(kFamilies[0].cells({0.3, 0.5}));
}

}  // namespace
}  // namespace swarmcert::stability

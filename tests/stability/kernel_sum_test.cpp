#include "stability/bounds/loops/kernel_sum.h"

#include <gtest/gtest.h>

#include "nn/base/random.h"

namespace swarmcert::stability {
namespace {

struct Stretch {
  double start, slope, length;
};

/// Computes the norms of GainNorms by sums over small steps.
GainNorms by_steps(const std::vector<Stretch>& stretches) {
  constexpr int kSteps = 4000;
  GainNorms norms;
  double integral = 0;
  for (const Stretch& s : stretches) {
    const double step = s.length / kSteps;
    for (int k = 0; k < kSteps; ++k) {
      const double value = s.start + s.slope * (k + 0.5) * step;
      norms.amplitude += std::abs(value) * step;
      norms.rate += std::abs(integral + value * step / 2) * step;
      integral += value * step;
      norms.edge = std::max(norms.edge, std::abs(integral));
      norms.impulse = std::max(norms.impulse, std::abs(value));
    }
  }
  return norms;
}

void expect_near(const GainNorms& a, const GainNorms& b, double relative) {
  EXPECT_NEAR(a.rate, b.rate, relative * b.rate);
  EXPECT_NEAR(a.amplitude, b.amplitude, relative * b.amplitude);
  EXPECT_NEAR(a.edge, b.edge, relative * b.edge);
  EXPECT_NEAR(a.impulse, b.impulse, relative * b.impulse);
}

TEST(KernelSum, AgreesWithSumsOverSmallStepsForKernelsThatChangeTheirSign) {
  files::Random random(6);
  int crossings = 0;
  for (int run = 0; run < 20; ++run) {
    std::vector<Stretch> stretches;
    KernelSum sum;
    for (int k = 0; k < 6; ++k) {
      const Stretch s = {random.symmetric(), 4 * random.symmetric(), 0.1 + random.uniform()};
      crossings += s.start * (s.start + s.slope * s.length) < 0 ? 1 : 0;
      stretches.push_back(s);
      sum.add_linear(s.start, s.slope, s.length);
    }
    expect_near(sum.norms(), by_steps(stretches), 2e-3);
  }
  EXPECT_GT(crossings, 30);
}

TEST(KernelSum, ASeriesIsTheSameStretchAgainAndAgain) {
  for (const double ratio : {0.3, 0.9}) {
    KernelSum series, stretches;
    series.add_series(0.5, 0.4, 0.2, ratio);
    double scale = 1;
    for (int k = 0; k < 500; ++k, scale *= ratio) stretches.add_linear(0.5 * scale, 0.4 * scale, 0.2);
    // The area under the integral grows with each segment: only the norms of the kernel itself form a convergent
    // series.
    EXPECT_NEAR(series.norms().amplitude, stretches.norms().amplitude, 1e-12);
    EXPECT_NEAR(series.norms().edge, stretches.norms().edge, 1e-12);
    EXPECT_NEAR(series.norms().impulse, stretches.norms().impulse, 1e-12);
  }
}

TEST(KernelVariation, CountsSlopesJumpsAndTheReturnToZero) {
  KernelVariation variation;
  variation.add_linear(1, 2, 0.5);    // 0 -> 1, then to 2
  variation.add_linear(-1, 0, 0.25);  // -> -1
  EXPECT_DOUBLE_EQ(variation.total(), 1 + 1 + 3 + 1);
  EXPECT_DOUBLE_EQ(variation.most_per_period(), 3);
}

TEST(KernelVariation, ASeriesIsTheSameStretchAgainAndAgain) {
  KernelVariation series, stretches;
  series.add_series(1, -2, 0.25, 0.8);
  double scale = 1;
  for (int k = 0; k < 400; ++k, scale *= 0.8) stretches.add_linear(scale, -2 * scale, 0.25);
  EXPECT_NEAR(series.total(), stretches.total(), 1e-12);
}

}  // namespace
}  // namespace swarmcert::stability

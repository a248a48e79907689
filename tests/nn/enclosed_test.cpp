/// Tests exact sums and enclosed numbers against identities that hold in double.
#include "nn/weights/enclosed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace swarmcert::files {
namespace {

TEST(ExactSum, IsExactWhereADoubleHoldsTheSum) {
  ExactSum sum;
  sum.add({1, 0});
  sum.add_product({1e16, 0}, {1e10, 0});
  sum.add_product({-1e16, 0}, {1e10, 0});
  EXPECT_EQ(sum.value().value, 1);
  EXPECT_EQ(sum.value().radius, 0);
  sum.add({0x1p-60, 0});
  EXPECT_EQ(sum.value().value, 1);
  EXPECT_GE(sum.value().radius, 0x1p-60);
  EXPECT_LT(sum.value().radius, 0x1p-59);
}

/// Half a unit in the last place of 1, and a little on one of its sides: 1 alone would be the even one of both.
TEST(ExactSum, IsRoundedToNearestAlsoWhereTheRestIsHalfAUnitAndALittle) {
  for (const double sign : {1.0, -1.0})
    for (const double little : {0x1p-80, 0.0, -0x1p-80, 0x1p-110}) {
      ExactSum sum;
      for (const double part : {0x1p-53, 1.0, little}) sum.add({sign * part, 0});
      EXPECT_EQ(sum.value().value, sign * (little > 0 ? 1 + 0x1p-52 : 1)) << sign << " " << little;
      EXPECT_GE(sum.value().radius, 0x1p-53 - 0x1p-80);
      EXPECT_LT(sum.value().radius, 0x1p-52);
    }
}

TEST(ExactSum, EnclosesProductsThatUnderflow) {
  ExactSum sum;
  sum.add_product({0x1p-600, 0}, {0x1p-600, 0});
  EXPECT_EQ(sum.value().value, 0);
  EXPECT_GT(sum.value().radius, 0);
}

TEST(ExactSum, IsNotFiniteBeyondTheRangeOfDouble) {
  ExactSum sum;
  sum.add_product({1e200, 0}, {1e200, 0});
  EXPECT_FALSE(std::isfinite(sum.value().value));
}

TEST(Enclosed, QuotientsAndRootsContainTheExactNumber) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw(0.1, 10);
  int inexact = 0;
  for (int i = 0; i < 1000; ++i) {
    const double a = draw(random), b = draw(random);
    const Enclosed quotient = divided({a, 0}, {b, 0});
    EXPECT_LE(std::fabs(std::fma(quotient.value, b, -a)), quotient.radius * b * (1 + 1e-9));
    const Enclosed root = square_root({a, 0});
    EXPECT_LE(std::fabs(std::fma(root.value, root.value, -a)), root.radius * 2 * root.value * (1 + 1e-9));
    inexact += quotient.radius > 0 && root.radius > 0 ? 1 : 0;
    EXPECT_LT(quotient.radius, 1e-15 * quotient.value);
  }
  EXPECT_GT(inexact, 900);
  EXPECT_EQ(divided({3, 0}, {2, 0}).radius, 0);
  EXPECT_EQ(square_root({2.25, 0}).radius, 0);
  EXPECT_EQ(square_root({2.25, 0}).value, 1.5);
}

TEST(Enclosed, RadiiGrowByWhatTheOperandsMayDiffer) {
  const Enclosed a{2, 0.25}, b{4, 0.5};
  const auto contains = [](const Enclosed& e, double x) { return std::fabs(e.value - x) <= e.radius; };
  for (const double da : {-0.25, 0.25})
    for (const double db : {-0.5, 0.5}) {
      EXPECT_TRUE(contains(times(a, b), (2 + da) * (4 + db)));
      EXPECT_TRUE(contains(divided(a, b), (2 + da) / (4 + db)));
      EXPECT_TRUE(contains(square_root(a), std::sqrt(2 + da)));
    }
}

TEST(Enclosed, NormIsNotBelowTheEuclideanOne) {
  EXPECT_GE(norm_up({3, -4}), 5);
  EXPECT_LT(norm_up({3, -4}), 5 + 1e-6);
  EXPECT_EQ(norm_up({}), 0);
  EXPECT_GE(norm_up({3e300, 4e300}), 5e300);
}

}  // namespace
}  // namespace swarmcert::files

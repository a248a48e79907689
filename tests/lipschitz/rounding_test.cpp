// Directed rounding of exact numbers to doubles.
#include "lipschitz/base/rounding.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nn/base/random.h"

namespace swarmcert {
namespace {

using check::Dyadic;
using lipschitz::rounded_down;
using lipschitz::rounded_up;
using lipschitz::sqrt_up;

constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

/// Returns a product of two doubles, whose magnitude may exceed the range of double and which has more bits than a
/// double.
Dyadic product_of_two(files::Random& random) {
  const double a = 0.5 + random.uniform() / 2, b = 0.5 + random.uniform() / 2;
  Dyadic x = Dyadic(a) * b;
  x.exponent += static_cast<long>(2100 * random.uniform()) - 1080;
  return x;
}

TEST(Rounding, IsTheNearestDoubleOnItsSide) {
  files::Random random(1);
  for (int k = 0; k < 5000; ++k) {
    const Dyadic x = product_of_two(random);
    const double above = rounded_up(x), below = rounded_down(x);
    ASSERT_TRUE(Dyadic(above) >= x && x >= Dyadic(below)) << above;
    if (above != below) {
      EXPECT_EQ(std::nextafter(below, kLargest), above);
    }
    EXPECT_EQ(rounded_up(-x), -below);
  }
  EXPECT_EQ(rounded_up(Dyadic(0.1)), 0.1);
  EXPECT_EQ(rounded_up(Dyadic()), 0);
  EXPECT_EQ(rounded_up(Dyadic(kLeast) * 0.5), kLeast);
  EXPECT_EQ(rounded_down(Dyadic(kLeast) * 0.5), 0);
}

TEST(Rounding, BeyondTheDoublesIsInfiniteOnTheSideOfTheBound) {
  for (const Dyadic& huge : {Dyadic(kLargest) + Dyadic(1.0), Dyadic(kLargest) * kLargest}) {
    EXPECT_EQ(rounded_up(huge), std::numeric_limits<double>::infinity());
    EXPECT_EQ(rounded_down(huge), kLargest);
    EXPECT_EQ(rounded_up(-huge), -kLargest);
  }
}

TEST(Rounding, ARootIsTheSmallestDoubleWhoseSquareIsEnough) {
  files::Random random(2);
  for (int k = 0; k < 5000; ++k) {
    Dyadic square = product_of_two(random);
    if (k % 2 == 0) square.exponent *= 2;  // beyond the range of double, with a root inside it
    const double root = sqrt_up(square);
    ASSERT_TRUE(std::isfinite(root));
    EXPECT_TRUE(Dyadic(root) * root >= square) << root;
    const double less = std::nextafter(root, 0.0);
    EXPECT_FALSE(Dyadic(less) * less >= square) << root;
  }
  EXPECT_EQ(sqrt_up(Dyadic()), 0);
  EXPECT_EQ(sqrt_up(Dyadic(kLargest) * kLargest), kLargest);
  EXPECT_EQ(sqrt_up(Dyadic(kLeast) * kLeast), kLeast);
  EXPECT_EQ(sqrt_up(Dyadic(kLargest) * kLargest * 2.0), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace swarmcert

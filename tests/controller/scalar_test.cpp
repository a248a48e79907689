#include "controller/scalar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nn/base/random.h"

namespace swarmcert::controller {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Scalar, LimitsAreThoseOfTheStandardLibraryForNumbers) {
  files::Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const auto x = static_cast<float>(10 * random.symmetric()), a = static_cast<float>(random.symmetric());
    const float b = a + static_cast<float>(random.uniform());
    ASSERT_EQ(clamp(x, a, b), std::clamp(x, a, b)) << x << " in " << a << ", " << b;
    ASSERT_EQ(absolute(x), std::abs(x));
    ASSERT_EQ(positive_part(x), std::max(x, 0.0F));
    if (x >= 0) {
      ASSERT_EQ(square_root(x), std::sqrt(x));
    }
  }
}

TEST(Scalar, ANanIsNotHiddenByALimit) {
  EXPECT_TRUE(std::isnan(clamp(kNan, -1.0F, 1.0F)));
  EXPECT_TRUE(std::isnan(positive_part(kNan)));
  EXPECT_TRUE(std::isnan(absolute(kNan)));
  EXPECT_TRUE(std::isnan(square_root(kNan)));
}

TEST(Scalar, TheRootOfARoundingErrorIsZero) {
  EXPECT_EQ(square_root(-1e-12F), 0.0F);
  EXPECT_EQ(square_root(-0.0F), 0.0F);
}

}  // namespace
}  // namespace swarmcert::controller

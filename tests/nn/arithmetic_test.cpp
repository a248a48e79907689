#include "nn/arithmetic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nn/base/random.h"

namespace swarmcert::nn {
namespace {

TEST(Arithmetic, ThisBuildRoundsEveryProduct) { EXPECT_FALSE(arithmetic_is_fused()); }

TEST(Arithmetic, AProductIsRoundedBeforeItEntersASum) {
  files::Random random(1);
  int different = 0;
  for (int i = 0; i < 10000; ++i) {
    const auto a = static_cast<float>(random.symmetric()), b = static_cast<float>(random.symmetric());
    const volatile float product = a * b;  // stored to memory, so it cannot be fused
    const float c = -product;
    ASSERT_EQ(rounded(a * b) + c, 0.0F) << a << ", " << b;
    different += std::fma(a, b, c) != 0.0F ? 1 : 0;
  }
  EXPECT_GT(different, 5000) << "a fused operation must give another result in most cases";
}

TEST(Arithmetic, IsFiniteOfAllNumbersButInfinitiesAndNan) {
  using Float = std::numeric_limits<float>;
  using Double = std::numeric_limits<double>;
  for (const float x : {0.0F, -0.0F, Float::denorm_min(), Float::max(), Float::lowest()})
    EXPECT_TRUE(is_finite(x)) << x;
  for (const double x : {0.0, Double::denorm_min(), Double::max(), Double::lowest()})
    EXPECT_TRUE(is_finite(x)) << x;
  for (const float x : {Float::infinity(), -Float::infinity(), Float::quiet_NaN(), -Float::signaling_NaN()})
    EXPECT_FALSE(is_finite(x)) << x;
  for (const double x : {Double::infinity(), -Double::infinity(), Double::quiet_NaN()})
    EXPECT_FALSE(is_finite(x)) << x;
}

TEST(Arithmetic, BitsTellZerosApart) {
  EXPECT_EQ(bits(0.0F), 0U);
  EXPECT_EQ(bits(-0.0F), 0x80000000U);
  EXPECT_EQ(bits(1.0), 0x3ff0000000000000ULL);  // IEEE 754: sign 0, exponent 1023, fraction 0
}

}  // namespace
}  // namespace swarmcert::nn

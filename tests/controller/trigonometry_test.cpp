#include "controller/trigonometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

template <typename Scalar>
double largest_error(double range_rad) {
  std::mt19937 generator(1);
  double worst = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const auto x = static_cast<Scalar>(tests::uniform(generator, -range_rad, range_rad));
    const SineCosine<Scalar> s = sin_cos(x);
    const long double exact = x;
    worst =
        std::fmax(worst, static_cast<double>(std::fabs(static_cast<long double>(s.sine) - std::sin(exact))));
    worst = std::fmax(worst,
                      static_cast<double>(std::fabs(static_cast<long double>(s.cosine) - std::cos(exact))));
  }
  return worst;
}

TEST(SinCos, StaysWithinTheStatedErrorInFloat) {
  EXPECT_LE(largest_error<float>(3.2), 1.2e-7);
  EXPECT_LE(largest_error<float>(kLargestAngle_rad), 1.2e-7);
}

TEST(SinCos, StaysWithinTheStatedErrorInDouble) {
  EXPECT_LE(largest_error<double>(kLargestAngle_rad), 1e-13);
}

TEST(SinCos, IsNotANumberWhereItIsNotDefined) {
  for (const float x :
       {101.0f, -1e30f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(sin_cos(x).sine)) << x;
    EXPECT_TRUE(std::isnan(sin_cos(x).cosine)) << x;
  }
}

}  // namespace
}  // namespace swarmcert::controller

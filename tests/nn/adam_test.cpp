#include "nn/training/adam.h"

#include <gtest/gtest.h>

#include <cmath>

namespace swarmcert::training {
namespace {

TEST(Adam, TheFirstStepHasTheLengthOfTheRateWhateverTheSizeOfTheGradient) {
  for (const float size : {1e-4F, 1.0F, 1e4F}) {
    Adam adam(3);
    Vector theta = Vector::Zero(3), gradient(3);
    gradient << size, -size, 0;
    adam.step(theta, gradient, 0.01);
    // m / (1 - 0.9) = g and v / (1 - 0.999) = g^2.
    EXPECT_NEAR(theta[0], -0.01, 0.01 * (1e-8 / size + 1e-6)) << size;
    EXPECT_EQ(theta[1], -theta[0]) << size;
    EXPECT_EQ(theta[2], 0) << size;
    EXPECT_EQ(adam.steps, 1U);
  }
}

/// Compares with Kingma and Ba 2015, algorithm 1, in double.
TEST(Adam, FollowsThePublishedAlgorithm) {
  Adam adam(1);
  Vector theta = Vector::Ones(1), gradient(1);
  double m = 0, v = 0, expected = 1;
  for (int t = 1; t <= 100; ++t) {
    gradient[0] = static_cast<float>(std::sin(t));
    adam.step(theta, gradient, 0.02);
    const double g = gradient[0];
    m = 0.9 * m + 0.1 * g;
    v = 0.999 * v + 0.001 * g * g;
    expected -= 0.02 * m / (1 - std::pow(0.9, t)) / (std::sqrt(v / (1 - std::pow(0.999, t))) + 1e-8);
    ASSERT_NEAR(theta[0], expected, 1e-5) << t;
  }
}

}  // namespace
}  // namespace swarmcert::training

// Norms of responses with closed forms: two real poles, an oscillator (the geometric series of its half waves), a
// delayed integrator.
#include "stability/bounds/loops/impulse_response.h"

#include <gtest/gtest.h>

#include <cmath>

#include "stability/bounds/loops/polynomial.h"

namespace swarmcert::stability {
namespace {

constexpr double kHalfTurn = 3.14159265358979323846;

TEST(Polynomials, ProductsSumsAndDerivativesAreThoseOfTheFunctions) {
  const Polynomial p = {1, -2, 0.5}, q = {3, 4};
  for (const double s : {-1.5, 0.0, 0.25, 2.0}) {
    EXPECT_DOUBLE_EQ(value(product(p, q), s), value(p, s) * value(q, s));
    EXPECT_DOUBLE_EQ(value(sum(q, p), s), value(p, s) + value(q, s));
    EXPECT_DOUBLE_EQ(value(times_s_to(2, p), s), s * s * value(p, s));
    EXPECT_DOUBLE_EQ(value(derivative_of(p), s), -2 + s);
  }
  EXPECT_EQ(rising_factorial(2, 3), 3 * 4 * 5);
}

TEST(ImpulseResponse, OfTwoRealPolesHasTheNormsOfItsClosedForm) {
  // y = exp(-t) - exp(-2 t), which rises to 1/4 at t = ln 2 and then decreases.
  const ResponseNorms norms = response_norms({{1}, {2, 3, 1}});
  EXPECT_NEAR(norms.integral, 0.5, 1e-12);
  EXPECT_NEAR(norms.integral_abs, 0.5, 1e-12);
  EXPECT_NEAR(norms.max, 0.25, 1e-12);
  EXPECT_EQ(norms.min, 0);
  EXPECT_NEAR(norms.step_max_abs, 0.5, 1e-12);
  EXPECT_NEAR(norms.variation, 0.5, 1e-12);
  EXPECT_NEAR(norms.slope_max_abs, 1, 1e-12);
}

TEST(ImpulseResponse, OfAnOscillatorHasTheAbsoluteIntegralOfItsHalfWaves) {
  // y = exp(-z t) sin(w t) / w: each half wave is exp(-z pi / w) of the one before it.
  for (const double z : {0.05, 0.3, 0.8}) {
    const double w = std::sqrt(1 - z * z);
    const ResponseNorms norms = response_norms({{1}, {1, 2 * z, 1}});
    const double expected = 1 / std::tanh(kHalfTurn * z / (2 * w));
    EXPECT_NEAR(norms.integral_abs, expected, 1e-11 * expected) << z;
    EXPECT_NEAR(norms.integral, 1, 1e-11);
    EXPECT_LT(norms.min, 0);
  }
}

TEST(ImpulseResponse, SamplesAreValuesOfTheClosedForm) {
  const std::vector<double> samples = sampled_response({{1}, {2, 3, 1}}, 0.1, 50);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = 0.1 * static_cast<double>(i);
    EXPECT_NEAR(samples[i], std::exp(-t) - std::exp(-2 * t), 1e-12);
  }
}

TEST(ImpulseResponse, DelayMarginOfAnIntegratorIsAQuarterPeriod) {
  // s + k exp(-T s) loses stability at T = pi / (2 k).
  for (const double k : {0.5, 2.0, 7.0}) {
    EXPECT_NEAR(delay_margin({0, 1}, {k}), kHalfTurn / (2 * k), 1e-9);
    EXPECT_TRUE(is_stable({{1}, {0, 1}, {k}, 0.99 * kHalfTurn / (2 * k)}));
    EXPECT_FALSE(is_stable({{1}, {0, 1}, {k}, 1.01 * kHalfTurn / (2 * k)}));
  }
  EXPECT_TRUE(std::isinf(response_norms({{1}, {-1, 1}}).integral_abs)) << "an unstable pole";
}

TEST(ImpulseResponse, NormsAreThoseOfADelayedLoopIntegratedInSteps) {
  // y' = -k y(t - T) from y(0) = 1, by Heun's rule on a fine grid.
  const double k = 2, T = 0.5, step = 1e-4;
  const auto late = static_cast<std::size_t>(std::lround(T / step));
  std::vector<double> y = {1};
  double integral_abs = 0, least = 0;
  for (std::size_t i = 0; i < 400'000; ++i) {
    const double a = i >= late ? y[i - late] : 0, b = i + 1 >= late ? y[i + 1 - late] : 0;
    y.push_back(y[i] - step * k * (a + b) / 2);
    integral_abs += step * (std::abs(y[i]) + std::abs(y[i + 1])) / 2;
    least = std::min(least, y[i + 1]);
  }
  const ResponseNorms norms = response_norms({{1}, {0, 1}, {k}, T});
  EXPECT_NEAR(norms.integral_abs, integral_abs, 1e-3 * integral_abs);
  EXPECT_NEAR(norms.min, least, 1e-3);
  EXPECT_NEAR(norms.integral, 1 / k, 1e-9);
}

}  // namespace
}  // namespace swarmcert::stability

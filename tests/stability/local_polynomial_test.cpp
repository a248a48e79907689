#include "stability/bounds/enclosures/local_polynomial.h"

#include <gtest/gtest.h>

#include "nn/base/random.h"

namespace swarmcert::stability {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Taylor coefficients of sin(a + s) and of its antiderivative -cos(a + s), with a bound on the next term.
LocalPolynomial wave(double phase) {
  LocalPolynomial p;
  double factorial = 1;
  for (int k = 0; k < kLocalTerms; ++k) {
    if (k > 0) factorial *= k;
    const double value = std::sin(phase + k * kPi / 2) / factorial;
    p.c[static_cast<std::size_t>(k)] = {value - 1e-15, value + 1e-15};
  }
  p.remainder = 1.01 / (factorial * kLocalTerms);
  return p;
}

TEST(LocalPolynomial, RangeContainsTheFunctionBetweenTheEnds) {
  files::Random random(3);
  for (int run = 0; run < 300; ++run) {
    const double phase = 3 * random.symmetric(), a = random.uniform(), b = a + 0.3 * random.uniform();
    const Interval range = wave(phase).range(a, b);
    for (int k = 0; k <= 10; ++k) {
      const double value = std::sin(phase + a + (b - a) * k / 10);
      EXPECT_LE(range.lower, value);
      EXPECT_GE(range.upper, value);
    }
    EXPECT_LE(range.upper - range.lower, 3 * (b - a) + 1e-12) << "no wider than the slope allows";
  }
}

/// int_0^{4 pi} |sin| = 8, and the same over whole turns from any phase.
TEST(LocalPolynomial, AbsoluteIntegralEnclosesThatOfAWaveOverItsZeros) {
  for (const double phase : {0.0, 0.3, 2.0}) {
    AbsoluteIntegral integral;
    const double step = 4 * kPi / 50;
    for (int k = 0; k < 50; ++k)
      integral.add(wave(phase + k * step), wave(phase + k * step - kPi / 2), 0, step, kLocalDepth);
    const Interval total = integral.finish();
    EXPECT_LE(total.lower, 8) << phase;
    EXPECT_GE(total.upper, 8) << phase;
    EXPECT_LT(total.upper - total.lower, 1e-11) << phase;
  }
}

TEST(LocalPolynomial, SupremumEnclosesTheCrestOfAWaveInsideAStretch) {
  double lower = 0;
  Interval best;
  raise_supremum(wave(1), wave(1 + kPi / 2), 0, 1.2, kLocalDepth, lower, best);
  EXPECT_LE(best.lower, 1);
  EXPECT_GE(best.upper, 1);
  EXPECT_LT(best.upper - best.lower, 1e-9);
}

TEST(LocalPolynomial, AnErrorBallWidensEveryEnclosureByItself) {
  LocalPolynomial p = wave(0.4);
  const Interval before = p.at(0.2);
  p.error = 0.01;
  const Interval after = p.at(0.2);
  EXPECT_NEAR(before.lower - after.lower, 0.01, 1e-12);
  EXPECT_NEAR(after.upper - before.upper, 0.01, 1e-12);
}

}  // namespace
}  // namespace swarmcert::stability

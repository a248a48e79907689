// Every interval operation contains the results of the operation for numbers in the intervals.
#include "nn/base/interval.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nn/base/random.h"

namespace swarmcert {
namespace {

bool contains(Interval a, double x) { return a.lower <= x && x <= a.upper; }

/// Returns a random interval: around zero, beside zero, touching zero, or a single number.
Interval random_interval(files::Random& random) {
  const double a = 3 * random.symmetric(), b = 3 * random.symmetric();
  switch (random.below(4)) {
    case 0:
      return {-std::abs(a), std::abs(b)};
    case 1:
      return {0, std::abs(b)};
    case 2:
      return {a, a};
    default:
      return {std::min(a, b), std::max(a, b)};
  }
}

TEST(Interval, DivisionByAnIntervalWithZeroGivesTheWholeLine) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Interval divisor :
       {Interval(-1, 1), Interval(0, 1), Interval(-1, 0), Interval(0), Interval(-0.0)}) {
    const Interval quotient = Interval(1, 2) / divisor;
    EXPECT_EQ(quotient.lower, -infinity);
    EXPECT_EQ(quotient.upper, infinity);
  }
  // Further operations on the result are still enclosures.
  const Interval product = Interval(1, 2) / Interval(-1, 1) * Interval(0, 1);
  EXPECT_TRUE(contains(product, 1e300) && contains(product, -1e300));
}

TEST(Interval, OperationsContainTheResultForNumbersOfTheIntervals) {
  files::Random random(11);
  int by_zero = 0;
  for (int i = 0; i < 20000; ++i) {
    const Interval a = random_interval(random), b = random_interval(random);
    const auto pick = [&](Interval x) {
      return std::clamp(x.lower + (x.upper - x.lower) * 0.5 * (1 + random.symmetric()), x.lower, x.upper);
    };
    const double x = pick(a), y = pick(b);
    EXPECT_TRUE(contains(a + b, x + y) && contains(a - b, x - y) && contains(a * b, x * y));
    if (y != 0) {
      EXPECT_TRUE(contains(a / b, x / y)) << x << " / " << y;
    }
    by_zero += contains(b, 0) ? 1 : 0;
  }
  EXPECT_GT(by_zero, 5000);
}

TEST(Interval, NeighboursOfADoubleAreThoseOfNextafter) {
  const double infinity = std::numeric_limits<double>::infinity();
  const auto check = [infinity](double x) {
    EXPECT_EQ(up(x), std::nextafter(x, infinity)) << x;
    EXPECT_EQ(down(x), std::nextafter(x, -infinity)) << x;
  };
  using Limits = std::numeric_limits<double>;
  for (const double x : {0.0, 1.0, Limits::denorm_min(), Limits::min(), Limits::max(), infinity}) {
    check(x);
    check(-x);
  }
  files::Random random(5);
  for (int i = 0; i < 20000; ++i)
    check(std::ldexp(random.symmetric(), static_cast<int>(random.below(2000)) - 1000));
  EXPECT_TRUE(std::isnan(up(Limits::quiet_NaN())) && std::isnan(down(Limits::quiet_NaN())));
}

TEST(Interval, PowersAreMultipliedOut) {
  EXPECT_EQ(nth_power(Interval(2), 0).lower, 1);
  for (const double x : {0.1, 0.75, 1.0, 1.5}) {
    long double exact = 1;
    for (int n = 0; n <= 18; ++n, exact *= static_cast<long double>(x)) {
      const Interval power = nth_power(Interval(x), n);
      EXPECT_LE(static_cast<long double>(power.lower), exact);
      EXPECT_GE(static_cast<long double>(power.upper), exact);
      EXPECT_LE(power.upper - power.lower, 1e-14 * power.upper);
    }
  }
}

}  // namespace
}  // namespace swarmcert

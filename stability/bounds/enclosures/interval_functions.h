/// @file Enclosures of exp, log and pow by interval arithmetic, independent of the accuracy of libm.
#pragma once

#include <stdexcept>

#include "nn/base/doubles.h"
#include "nn/base/interval.h"

namespace swarmcert::stability {

/// Encloses e^x of one double. With y = x/2^k, |y| <= 1/4: the Taylor polynomial of degree 13, whose remainder is below
/// 1.3 |y|^14/14!, squared k times. Beyond +-700, near the limits of doubles, [0, 1e-300] or [1e300, oo].
inline Interval exp_of(double x) {
  if (!(x > -700)) return {0, 1e-300};
  if (!(x < 700)) return {1e300, kInfinity};
  int halvings = 0;
  while (std::abs(std::ldexp(x, -halvings)) > 0.25) ++halvings;
  const Interval y(std::ldexp(x, -halvings));  // exact
  Interval total(0);
  for (int k = 13; k > 0; --k) total = (total + Interval(1)) * y / Interval(k);
  constexpr double kRemainder = 1.3 * 3.8e-9 / 8.7e10;  // 1.3 0.25^14/14!, rounded up
  total = total + Interval(1) + Interval(-kRemainder, kRemainder);
  for (int i = 0; i < halvings; ++i) total = total * total;
  return total;
}

inline Interval exp(Interval x) { return {std::max(0.0, exp_of(x.lower).lower), exp_of(x.upper).upper}; }

/// Encloses ln x of one positive double: the result of libm, widened until exp() proves the enclosure.
inline Interval log_of(double x) {
  const double guess = std::log(x);
  double slack = 1e-15 * std::max(1.0, std::abs(guess));
  for (int i = 0; i < 60; ++i, slack *= 2) {
    const Interval result(guess - slack, guess + slack);
    if (exp_of(result.lower).upper <= x && exp_of(result.upper).lower >= x) return result;
  }
  throw std::domain_error("log of " + std::to_string(x) + " could not be enclosed");
}

/// Encloses x^n for x > 0.
inline Interval pow(Interval x, double n) {
  if (n == 0) return Interval(1);
  return exp(Interval(n) * Interval(log_of(x.lower).lower, log_of(x.upper).upper));
}

}  // namespace swarmcert::stability

/// @file Enclosures of squares, exp, log, pow, sin and cos by interval arithmetic, independent of the accuracy of libm.
#pragma once

#include <stdexcept>

#include "nn/base/doubles.h"
#include "nn/base/interval.h"

namespace swarmcert::stability {

/// Encloses x^2.
inline Interval square(Interval x) { return abs(x) * abs(x); }

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

/// Encloses x^first/first! - x^(first + 2)/(first + 2)! + ...: cos x for `first` 0, sin x for 1. The terms alternate
/// and decrease from degree 4 on, so the first one left out bounds the remainder. [-1, 1] for |x| > 4.
inline Interval alternating_series(double x, int first) {
  if (!(std::abs(x) <= 4)) return {-1, 1};
  Interval total(0), term = first == 0 ? Interval(1) : Interval(x);
  for (int n = first; n < 40; n += 2) {
    total += term;
    term = -term * Interval(x) * Interval(x) / Interval((n + 1) * (n + 2));
  }
  return total + Interval(-term.mag(), term.mag());
}
inline Interval cos_of(double x) { return alternating_series(x, 0); }
inline Interval sin_of(double x) { return alternating_series(x, 1); }

}  // namespace swarmcert::stability

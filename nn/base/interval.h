/// @file Two numbers with all between them; and operations with outward rounding, which enclose the exact result.
///
/// Rounding to nearest errs by at most half a unit in the last place, so one step outwards encloses. No
/// switching of rounding modes, which compilers reorder. Not valid under -ffast-math.
#pragma once

#ifdef __FAST_MATH__
#error "enclosures need IEEE arithmetic: compile without -ffast-math"
#endif

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert {

struct Interval {
  double lower = 0, upper = 0;

  constexpr Interval() = default;
  constexpr Interval(double value) : lower(value), upper(value) {}  // NOLINT: a double is an interval
  constexpr Interval(double low, double high) : lower(low), upper(high) {}

  double mag() const { return std::max(std::abs(lower), std::abs(upper)); }
  double mig() const { return lower > 0 ? lower : upper < 0 ? -upper : 0; }
  bool is_positive() const { return lower > 0; }
  bool is_negative() const { return upper < 0; }
};

/// The same ends.
inline bool operator==(Interval a, Interval b) { return a.lower == b.lower && a.upper == b.upper; }
inline bool operator!=(Interval a, Interval b) { return !(a == b); }

inline Interval operator-(Interval a) { return {-a.upper, -a.lower}; }
inline Interval operator+(Interval a, Interval b) { return {down(a.lower + b.lower), up(a.upper + b.upper)}; }
inline Interval operator-(Interval a, Interval b) { return {down(a.lower - b.upper), up(a.upper - b.lower)}; }
/// All real numbers: what is known of a result where nothing is.
inline Interval whole_line() { return {-kInfinity, kInfinity}; }
inline Interval operator*(Interval a, Interval b) {
  const double p[] = {a.lower * b.lower, a.lower * b.upper, a.upper * b.lower, a.upper * b.upper};
  if (std::isnan(p[0] + p[1] + p[2] + p[3])) return whole_line();  // zero times infinity
  return {down(*std::min_element(p, p + 4)), up(*std::max_element(p, p + 4))};
}
/// The whole line where b contains zero.
inline Interval operator/(Interval a, Interval b) {
  if (!b.is_positive() && !b.is_negative()) return whole_line();
  const double q[] = {a.lower / b.lower, a.lower / b.upper, a.upper / b.lower, a.upper / b.upper};
  if (std::isnan(q[0] + q[1] + q[2] + q[3])) return whole_line();  // infinity by infinity
  return {down(*std::min_element(q, q + 4)), up(*std::max_element(q, q + 4))};
}
inline Interval& operator+=(Interval& a, Interval b) { return a = a + b; }
inline Interval abs(Interval a) { return {a.mig(), a.mag()}; }
inline Interval sqrt(Interval a) {
  return {a.lower > 0 ? std::max(0.0, down(std::sqrt(a.lower))) : 0, up(std::sqrt(std::max(a.upper, 0.0)))};
}
/// x^n for n >= 0, by multiplication: what libm's pow rounds to is nowhere promised.
inline Interval nth_power(Interval x, int n) {
  Interval result(1);
  for (; n > 0; n /= 2, x = x * x) {
    if (n % 2 == 1) result = result * x;
  }
  return result;
}
inline Interval hull(Interval a, Interval b) {
  return {std::min(a.lower, b.lower), std::max(a.upper, b.upper)};
}

}  // namespace swarmcert

/// @file Closed intervals with outward-rounded arithmetic, which encloses the exact result.
///
/// A result that is rounded to nearest is off by at most half a unit in the last place, so moving each bound outwards
/// to the adjacent double encloses the exact result. Rounding modes are not switched, because compilers reorder
/// operations across the switch. Not valid under -ffast-math.
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

/// Compares the bounds.
inline bool operator==(Interval a, Interval b) { return a.lower == b.lower && a.upper == b.upper; }
inline bool operator!=(Interval a, Interval b) { return !(a == b); }

inline Interval operator-(Interval a) { return {-a.upper, -a.lower}; }
inline Interval operator+(Interval a, Interval b) { return {down(a.lower + b.lower), up(a.upper + b.upper)}; }
inline Interval operator-(Interval a, Interval b) { return {down(a.lower - b.upper), up(a.upper - b.lower)}; }
/// Returns the interval of all real numbers, for results about which nothing is known.
inline Interval whole_line() { return {-kInfinity, kInfinity}; }
inline Interval operator*(Interval a, Interval b) {
  const double p[] = {a.lower * b.lower, a.lower * b.upper, a.upper * b.lower, a.upper * b.upper};
  if (std::isnan(p[0] + p[1] + p[2] + p[3])) return whole_line();  // zero times infinity
  return {down(*std::min_element(p, p + 4)), up(*std::max_element(p, p + 4))};
}
/// Returns the whole line if b contains zero.
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
/// Returns an enclosure of x^n for n >= 0, by multiplication: the accuracy of libm's pow is not specified.
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

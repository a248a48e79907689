/// @file Intervals of doubles with outward rounding: every operation encloses the exact result.
///
/// Rounding to nearest errs by at most half a unit in the last place, so one step outwards encloses. No
/// switching of rounding modes, which compilers reorder. Not valid under -ffast-math.
#pragma once

#ifdef __FAST_MATH__
#error "enclosures need IEEE arithmetic: compile without -ffast-math"
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace swarmcert::stability {

struct Interval {
  double lo = 0, hi = 0;

  Interval() = default;
  Interval(double value) : lo(value), hi(value) {}  // NOLINT: a double is an interval
  Interval(double low, double high) : lo(low), hi(high) {}

  double mag() const { return std::max(std::abs(lo), std::abs(hi)); }
  double mig() const { return lo > 0 ? lo : hi < 0 ? -hi : 0; }
  bool is_positive() const { return lo > 0; }
  bool is_negative() const { return hi < 0; }
};

/// The next double above x; +infinity and NaN stay. As nextafter(), which costs a call: doubles of one sign are ordered
/// as their bits are.
inline double up(double x) {
  if (!(x < std::numeric_limits<double>::infinity())) return x;
  if (x == 0) return std::numeric_limits<double>::denorm_min();
  std::int64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  bits += x > 0 ? 1 : -1;
  std::memcpy(&x, &bits, sizeof bits);
  return x;
}
inline double down(double x) { return -up(-x); }

inline Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
inline Interval operator+(Interval a, Interval b) { return {down(a.lo + b.lo), up(a.hi + b.hi)}; }
inline Interval operator-(Interval a, Interval b) { return {down(a.lo - b.hi), up(a.hi - b.lo)}; }
/// All real numbers: what is known of a result where nothing is.
inline Interval whole_line() {
  return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
}
inline Interval operator*(Interval a, Interval b) {
  const double p[] = {a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi};
  if (std::isnan(p[0] + p[1] + p[2] + p[3])) return whole_line();  // zero times infinity
  return {down(*std::min_element(p, p + 4)), up(*std::max_element(p, p + 4))};
}
/// The whole line where b contains zero.
inline Interval operator/(Interval a, Interval b) {
  if (!b.is_positive() && !b.is_negative()) return whole_line();
  const double q[] = {a.lo / b.lo, a.lo / b.hi, a.hi / b.lo, a.hi / b.hi};
  if (std::isnan(q[0] + q[1] + q[2] + q[3])) return whole_line();  // infinity by infinity
  return {down(*std::min_element(q, q + 4)), up(*std::max_element(q, q + 4))};
}
inline Interval& operator+=(Interval& a, Interval b) { return a = a + b; }
inline Interval abs(Interval a) { return {a.mig(), a.mag()}; }
inline Interval sqrt(Interval a) {
  return {a.lo > 0 ? std::max(0.0, down(std::sqrt(a.lo))) : 0, up(std::sqrt(std::max(a.hi, 0.0)))};
}
/// x^n for n >= 0, by multiplication: what libm's pow rounds to is nowhere promised.
inline Interval nth_power(Interval x, int n) {
  Interval result(1);
  for (; n > 0; n /= 2, x = x * x) {
    if (n % 2 == 1) result = result * x;
  }
  return result;
}
inline Interval hull(Interval a, Interval b) { return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)}; }

}  // namespace swarmcert::stability

/// @file Infinity and adjacent doubles, for bounds that are rounded outwards.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>

namespace swarmcert {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Unit roundoff of double: the relative error of x op y is at most this unless the result underflows.
inline constexpr double kUnit = 0x1p-53;

/// Returns the next double above x; +infinity and NaN are returned unchanged. Same as nextafter() without the cost of a
/// call: doubles of one sign are ordered like their bit patterns.
inline double up(double x) {
  if (!(x < kInfinity)) return x;
  if (x == 0) return std::numeric_limits<double>::denorm_min();
  std::int64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  bits += x > 0 ? 1 : -1;
  std::memcpy(&x, &bits, sizeof bits);
  return x;
}
inline double down(double x) { return -up(-x); }

}  // namespace swarmcert

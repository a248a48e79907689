/// @file Infinity and neighbours of doubles, for bounds that are rounded outwards.
#pragma once

#include <cmath>
#include <limits>

namespace swarmcert {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Unit roundoff of double: x op y is off by at most this, relatively, where nothing underflows.
inline constexpr double kUnit = 0x1p-53;

inline double next_up(double x) { return std::nextafter(x, kInfinity); }
inline double next_down(double x) { return std::nextafter(x, -kInfinity); }

}  // namespace swarmcert

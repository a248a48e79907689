/// @file The circle constant, which the standard library has only since C++20.
#pragma once

namespace swarmcert {

inline constexpr double kPi = 3.14159265358979323846;

}  // namespace swarmcert

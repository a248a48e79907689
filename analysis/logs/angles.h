/// @file Angles and missing values, shared by the sources that interpret columns.
#pragma once

#include <limits>

#include "analysis/logs/log.h"
#include "nn/base/pi.h"

namespace swarmcert::logs {

/// One degree in radians.
inline constexpr double kDegree_rad = kPi / 180;
/// Marks a value that the log does not have.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Rz(yaw) Ry(pitch) Rx(roll)
Attitude attitude_of_angles(double roll, double pitch, double yaw);

}  // namespace swarmcert::logs

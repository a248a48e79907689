/// @file Clocks that several vehicles share.
#pragma once

#include <utility>

#include "analysis/logs/raw_log.h"
#include "nn/base/interval.h"

namespace swarmcert::logs {

/// Clocks beyond it, in seconds, count from 1970, or from a receiver's epoch.
inline constexpr double kAbsoluteClock_s = 1e8;

/// What a satellite receiver says must be added to the log's clock to get seconds since 1970: PX4's
/// vehicle_gps_position and sensor_gps, ArduPilot's GPS. 0 where no receiver had the time.
double receiver_offset_s(const RawLog& log);

/// First and last time of a log, in seconds since 1970; {0, 0} where its clock is not absolute.
Interval absolute_span_s(const RawLog& log);

}  // namespace swarmcert::logs

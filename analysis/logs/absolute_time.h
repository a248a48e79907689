/// @file Absolute time of logs, which relates the clocks of several vehicles.
#pragma once

#include <utility>

#include "analysis/logs/raw_log.h"
#include "nn/base/interval.h"

namespace swarmcert::logs {

/// Clocks above this value (in seconds) count from 1970 or from the epoch of a satellite receiver.
inline constexpr double kAbsoluteClock_s = 1e8;

/// Returns the offset that turns the log's clock into seconds since 1970, as a satellite receiver reports it: PX4's
/// vehicle_gps_position and sensor_gps, ArduPilot's GPS. Returns 0 if no receiver had the time.
double receiver_offset_s(const RawLog& log);

/// Returns the first and last time of a log in seconds since 1970; {0, 0} if its clock is not absolute.
Interval absolute_span_s(const RawLog& log);

}  // namespace swarmcert::logs

/// @file Converts PX4 and ArduPilot messages to the names of columns.toml: z up, body x forward, y left, SI units.
#pragma once

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Adds columns named position_x, attitude_w, motor_command_1, ... to the topics of PX4 (ULog, px4_msgs in ROS) and
/// ArduPilot that carry these signals. NED and FRD become z up and FLU: (x, -y, -z), q = (w, x, -y, -z). If a message
/// has several instances, the first one that is not constant is used.
void add_own_names(RawLog& log);

/// Adds an event "landed" to `log`, on the clock of `raw`, whenever PX4's land detector reports it.
void add_landed(const RawLog& raw, Log& log);

/// Returns whether the vehicle reports that it was armed.
Armed was_armed(const RawLog& log);

}  // namespace swarmcert::logs

/// @file PX4 and ArduPilot messages under the names of columns.toml: z up, body x forward, y left, SI units.
#pragma once

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Adds columns named position_x, attitude_w, motor_command_1, ... to the topics of PX4 (ULog, px4_msgs in ROS) and
/// ArduPilot that carry these signals. NED and FRD become z up and FLU: (x, -y, -z), q = (w, x, -y, -z).
/// Of several instances of a message the first counts that is not constant.
void add_own_names(RawLog& log);

/// Adds events "landed" to `log`, on the clock of `raw`: when PX4's land detector says so.
void add_landed(const RawLog& raw, Log& log);

/// Whether the vehicle says that it was armed.
Armed was_armed(const RawLog& log);

}  // namespace swarmcert::logs

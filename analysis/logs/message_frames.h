/// @file Converts PX4 and ArduPilot messages to the names of columns.toml: z up, body x forward, y left, SI units.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns the firmware that wrote the messages of a topic, "px4" or "ardupilot"; empty for others.
std::string firmware_of(const RawLog& log, const RawTopic& topic);

/// Returns the name of the message: "vehicle_local_position" also for the type px4_msgs/msg/VehicleLocalPosition.
std::string message_of(const RawTopic& topic);

/// Adds columns named position_x, attitude_w, motor_command_1, ... to the topics of PX4 (ULog, px4_msgs in ROS) and
/// ArduPilot that carry these signals. NED and FRD become z up and FLU: (x, -y, -z), q = (w, x, -y, -z). If a message
/// has several instances, the first one that is not constant is used. Records that PX4's estimator does not mark as
/// valid are left out; where these are most, its columns become NaN and are named in `notes`.
void add_own_names(RawLog& log, std::vector<std::string>& notes);

/// Adds an event "landed" to `log`, on the clock of `raw`, whenever the land detector of PX4 or ArduPilot reports it.
void add_landed(const RawLog& raw, Log& log);

/// Returns whether the vehicle reports that it was armed.
Armed was_armed(const RawLog& log);

/// Returns what the vehicle is if PX4 or ArduPilot says that it is not a multirotor, e.g. "fixed wing"; else nothing.
std::string vehicle_without_rotors(const RawLog& log);

}  // namespace swarmcert::logs

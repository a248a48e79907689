/// @file ArduPilot dataflash logs (`.bin`).
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns true if `head` starts with a format definition message.
bool looks_like_dataflash(std::string_view head);

/// Reads a log. Topics are named after their message ("XKF1", "ATT", "RCOU", "BAT", "MOTB"); a field that the log
/// declares as the instance becomes RawTopic::instance. Times come from `TimeUS` or `TimeMS`. Values have the units
/// stated in the log (UNIT), with its multipliers (MULT) and those of the number types (centidegrees to degrees, 1e-7
/// degrees to degrees) applied. Parameters are the first values in PARM; later values become parameter_changes. MSG
/// gives the messages.
/// If no message follows, the reader searches for the next two consecutive messages and counts the damaged place and
/// the skipped bytes.
/// @throws files::InputError if the file is empty or does not start with a format definition.
RawLog read_dataflash(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs

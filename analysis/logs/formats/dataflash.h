/// @file ArduPilot dataflash logs (`.bin`).
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// True if `head` starts with the message that defines a format.
bool looks_like_dataflash(std::string_view head);

/// Topics by message name ("XKF1", "ATT", "RCOU", "BAT", "MOTB"); where a message states a field to be its instance,
/// that is RawTopic::instance. Times from `TimeUS` or `TimeMS`. Values are in the units that the log states (UNIT),
/// with its multipliers (MULT) and those of the number types (centidegrees to degrees, 1e-7 degrees to degrees)
/// applied. Parameters from PARM: the first value of each; others are parameter_changes. MSG gives messages.
/// Where no message follows, the reader looks for the next two that follow each other, and counts the place and the
/// bytes.
/// @throws files::InputError if the file is empty, or does not start with a definition.
RawLog read_dataflash(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs

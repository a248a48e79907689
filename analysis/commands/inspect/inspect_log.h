/// @file What `inspect` says of a flight log.
#pragma once

#include <string>

#include "analysis/commands/shared/collection_table.h"
#include "analysis/logs/log.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Members format, signals[], judged, missing[], phases[], events[] and what else is known of the log.
files::Json describe_log(const logs::Log& log);

/// Of a log that was opened. @param described by describe_log().
LogOutcome outcome_of(const std::string& path, const logs::Log& log, const files::Json& described);

/// The same as text on stdout.
void print_log(const logs::Log& log);

/// One line of a table of logs: records, time in the air, axes that can be judged, and what speaks against a flight.
void print_log_row(const std::string& path, const files::Json& described);

}  // namespace swarmcert::analysis

/// @file Output of `inspect` for a flight log.
#pragma once

#include <string>

#include "analysis/commands/shared/collection_table.h"
#include "analysis/logs/log.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns the members format, signals[], judged, missing[], phases[], events[] and everything else known about the
/// log.
files::Json describe_log(const logs::Log& log);

/// Returns the outcome for a log that could be opened.
/// @param described result of describe_log().
LogOutcome outcome_of(const std::string& path, const logs::Log& log, const files::Json& described);

/// Prints the same as text to standard output.
void print_log(const logs::Log& log);

/// Prints one line of a table of logs: records, time in the air, axes that can be judged, and the reason if it is not
/// a flight.
void print_log_row(const std::string& path, const files::Json& described);

}  // namespace swarmcert::analysis

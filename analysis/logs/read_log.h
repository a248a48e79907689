/// @file Reading a flight log of any known format.
#pragma once

#include <iosfwd>
#include <string>
#include <utility>

#include "analysis/logs/raw_log.h"
#include "analysis/logs/signals.h"
#include "nn/base/interval.h"

namespace swarmcert::logs {

/// Reads a log; the format is recognised by content: micro-SD binary (old, versions 1 and 2), those of
/// formats/formats.h, else CSV.
/// @param map for CSV files with columns of their own; known_columns() otherwise: columns are recognised.
/// @throws files::InputError if the file cannot be read at all, with offset or line. Damage inside a file is no error:
///   it is skipped and counted in Log::health.
Log read_log(const std::string& path, const SignalMap& map = known_columns());

/// As read_log(), from a stream; `path` is used in messages only.
Log parse_log(std::istream& in, const std::string& path, const SignalMap& map = known_columns());

/// True if the file is named like a log or as CSV, or starts like a micro-SD log.
bool looks_like_log(const std::string& path);

/// True if the header of a CSV names a time and a position, velocity or acceleration. False where it cannot be read.
bool is_flight_table(const std::string& path);

/// First and last time of a CSV on its own clock, in seconds, from its first lines and its end; {0, 0} where it has
/// none.
Interval time_span_s(const std::string& path);

/// True for `[<prefix>_]cf<id>_<run>`, with or without ".csv".
bool is_log_name(const std::string& name);

/// The authors' 30 columns with their names, digits and units, for samples with t0 <= time < t1 in seconds of the
/// log's own clock. For a log that has all their signals this is their file, byte by byte.
void write_csv(const Log& log, double t0_s, double t1_s, std::ostream& out);

/// False where anything in the file was damaged. A pause in the recording (LogHealth::gaps) is no damage.
bool is_sound(const LogHealth& health);

/// Health in words, one finding per entry; empty if nothing was wrong.
std::vector<std::string> findings(const LogHealth& health);

}  // namespace swarmcert::logs

/// @file Reads flight logs of any known format.
#pragma once

#include <iosfwd>
#include <string>
#include <utility>

#include "analysis/logs/raw_log.h"
#include "analysis/logs/signals.h"
#include "nn/base/interval.h"

namespace swarmcert::logs {

/// Reads a log. The format is recognised by its content: micro-SD binary (old, versions 1 and 2), those of
/// formats/formats.h, else CSV.
/// @param path a file, a folder that holds one log, or FILE#VEHICLE (vehicles_in_file.h)
/// @param map meaning of the columns of a CSV file; without it they are recognised by name and evidence
/// @throws files::InputError if the file cannot be read at all; states the offset or line. Damage inside a file is not
///   an error: it is skipped and counted in Log::health. Also if the file holds the logs of several vehicles and
///   neither `path` nor `map` selects one of them.
Log read_log(const std::string& path, const SignalMap& map = {});

/// Returns what read_log() takes the columns of a file for, also if they show no motion.
/// @param notes receives what was decided from the data
/// @throws files::InputError as read_log() does
SignalMap meaning_of_columns(const std::string& path, std::vector<std::string>& notes);

/// Returns the topics of a file as read_log() interprets them.
RawLog read_uninterpreted(const std::string& path, const SignalMap& map = {});

/// Like read_log() for a stream; `path` is used only in messages.
Log parse_log(std::istream& in, const std::string& path, const SignalMap& map = {});

/// Returns true if the file is named like a log or a CSV file, starts like a micro-SD log, or is FILE#VEHICLE.
bool looks_like_log(const std::string& path);

/// Returns true if a CSV file can be read and its header names a time and a position, velocity or acceleration.
bool is_flight_table(const std::string& path);

/// Returns the first and last time of a CSV file on its own clock, in seconds, from its first lines and its end; {0, 0}
/// if it has none.
Interval time_span_s(const std::string& path);

/// Returns true for `[<prefix>_]cf<id>_<run>`, with or without ".csv".
bool is_log_name(const std::string& name);

/// Writes the authors' 30 columns with their names, digits and units, for samples with t0 <= time < t1 in seconds of
/// the log's own clock. For a log with all these signals the result equals the authors' file byte for byte.
void write_csv(const Log& log, double t0_s, double t1_s, std::ostream& out);

/// Whether everything that the vehicle logged is there.
enum class Completeness {
  kComplete,
  kCut,  ///< the recording ends inside a record, or has pauses in which the vehicle could not write; the rest is sound
  kDamaged  ///< records were lost or cannot be trusted
};
Completeness completeness_of(const LogHealth& health);

/// Returns the share of the records that was lost, counted in records, bytes or seconds, whichever says most; NaN if it
/// cannot be counted, as where a file ends early.
double lost_share(const Log& log);

/// Returns false if anything in the file was damaged. A pause in the recording (LogHealth::gaps) is not damage.
bool is_sound(const LogHealth& health);

/// Describes the health in words, one finding per entry; empty if nothing was wrong.
std::vector<std::string> findings(const LogHealth& health);

}  // namespace swarmcert::logs

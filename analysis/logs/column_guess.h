/// @file Guesses what the columns of a table mean from their values alone.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// A line of columns.toml, suggested by the values of a column.
struct ColumnGuess {
  std::string signal;  ///< name as in columns.toml, e.g. "velocity_x"
  std::size_t column = 0;
  std::string unit;
  const char* frame = nullptr;  ///< nullptr: the signal has none
  std::string evidence;
};

/// Returns the column that looks like a clock: it rises by nearly the same step with nearly every record, preferably by
/// something other than one per record. Returns -1 if there is none.
int guess_clock(const RawTopic& topic);

/// Guesses signals from values: quaternions by their norm, positions by velocities that are their derivatives, angles
/// by the lateral acceleration, rates by the quaternion, specific force by its magnitude, motors as four columns with a
/// common range, the battery by its range and decline. The columns of a group must be adjacent. Guesses only signals
/// that are not in `known`, from columns that are not `taken`. Precondition: topic.time_s is set.
std::vector<ColumnGuess> guess_columns(const RawTopic& topic, std::vector<char> taken,
                                       const std::vector<std::string>& known);

/// "0.12 .. 4.5, mean 1.1"; "always 3"; "no numbers".
std::string range_in_words(const RawColumn& column);

}  // namespace swarmcert::logs

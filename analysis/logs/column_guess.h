/// @file What the columns of a table may mean, judged by their values alone.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// A line of a columns.toml that values suggest.
struct ColumnGuess {
  std::string signal;  ///< as columns.toml names it, e.g. "velocity_x"
  std::size_t column = 0;
  std::string unit;
  const char* frame = nullptr;  ///< nullptr: the signal has none
  std::string evidence;
};

/// The column that is a clock: one that rises with nearly every record, by nearly the same step, preferably not by one
/// per record. -1 if none does.
int guess_clock(const RawTopic& topic);

/// Quaternions by their norm, positions by velocities that are their derivative, angles by the lateral acceleration,
/// rates by the quaternion, specific force by its size, motors as four numbers of one range, a battery by its range and
/// its fall. Groups stand in neighbouring columns. Only signals that are not in `known` are guessed, of columns that
/// are not `taken`. Precondition: topic.time_s is set.
std::vector<ColumnGuess> guess_columns(const RawTopic& topic, std::vector<char> taken,
                                       const std::vector<std::string>& known);

/// "0.12 .. 4.5, mean 1.1"; "always 3"; "no numbers".
std::string range_in_words(const RawColumn& column);

}  // namespace swarmcert::logs

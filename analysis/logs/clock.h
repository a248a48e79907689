/// @file The clock of a table of records.
#pragma once

#include <optional>

#include "analysis/logs/raw_log.h"
#include "analysis/logs/signals.h"

namespace swarmcert::logs {

/// The column of the times.
struct Clock {
  std::size_t column = 0;
  double unit_s =
      0;  ///< 0: decided from the steps, as the largest common unit that gives a plausible logging rate
};

/// Returns the column whose name says that it is a clock; -1 without one.
int clock_by_name(const RawTopic& topic);

/// Returns the clock of the last topic that `map` or, if that is empty, a name states.
/// @throws files::InputError if `map` names no time.
std::optional<Clock> stated_clock(const RawLog& log, const SignalMap& map);

/// Fills RawTopic::time_s of the last topic from `clock`, or else from the column that rises by nearly the same step
/// with nearly every record, preferably by something other than one. Log blocks of several rates, joined over time,
/// leave blanks: columns that have numbers in the same records, in less than nine tenths of those that have a time,
/// become a topic of these records only.
/// @throws files::InputError if no column can be the time.
void set_times(RawLog& log, std::optional<Clock> clock);

}  // namespace swarmcert::logs

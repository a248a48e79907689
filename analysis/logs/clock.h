/// @file Clocks: of a table of records, repaired, and absolute, which relates the logs of several vehicles.
#pragma once

#include <optional>

#include "analysis/logs/raw_log.h"
#include "analysis/logs/signals.h"
#include "nn/base/interval.h"

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

/// Keeps the records of `topic` with these indices, in this order.
void keep_records(RawTopic& topic, const std::vector<std::size_t>& order);

/// Undoes wraps of the clock, sorts records by time (those without one come last), and keeps one of several records
/// with the same time and values. A clock that starts again, as after a second take-off in the same file, is not
/// sorted: the records would mix two flights.
/// @return what was repaired
Repaired put_in_order(RawTopic& topic);

/// Clocks above this value (in seconds) count from 1970 or from the epoch of a satellite receiver.
inline constexpr double kAbsoluteClock_s = 1e8;

/// Returns the offset that turns the log's clock into seconds since 1970, as a satellite receiver reports it: PX4's
/// vehicle_gps_position and sensor_gps, ArduPilot's GPS. Returns 0 if no receiver had the time.
double receiver_offset_s(const RawLog& log);

/// Returns the first and last time of a log in seconds since 1970; {0, 0} if its clock is not absolute.
Interval absolute_span_s(const RawLog& log);

}  // namespace swarmcert::logs

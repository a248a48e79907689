/// @file Puts the records of a topic in order of time; nothing is lost by it.
#pragma once

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Undoes wraps of the clock, sorts records by time (those without one come last), and keeps one of several records
/// with the same time and values. A clock that starts again, as after a second take-off in the same file, is not
/// sorted: the records would mix two flights.
/// @return what was repaired
Repaired put_in_order(RawTopic& topic);

}  // namespace swarmcert::logs

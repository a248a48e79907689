/// @file Oscillations of a vehicle that nobody commanded.
#pragma once

#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// Limit cycles of roll or pitch in flight. Four or more periods in a row, each tilting the thrust axis by at least 0.1
/// rad (which accelerates sideways by a tenth of g) and each as long as the others within 30 %, faster than 1 Hz: a
/// loop damped by a tenth or more would have lost nine tenths of its amplitude by then, and no trajectory is that
/// regular.
/// @param air per record: in the air.
std::vector<LogEvent> limit_cycles(const Log& log, const std::vector<char>& air);

}  // namespace swarmcert::logs

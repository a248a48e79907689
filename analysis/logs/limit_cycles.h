/// @file Detects uncommanded oscillations of a vehicle.
#pragma once

#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// Finds limit cycles of roll or pitch in flight: four or more consecutive periods faster than 1 Hz, each tilting the
/// thrust axis by at least 0.1 rad (a lateral acceleration of a tenth of g), with durations that agree within 30 %. A
/// loop with a damping ratio of 0.1 or more would have lost nine tenths of its amplitude by then, and no trajectory is
/// that regular.
/// @param air whether the vehicle is airborne, per record
std::vector<LogEvent> limit_cycles(const Log& log, const std::vector<char>& air);

}  // namespace swarmcert::logs

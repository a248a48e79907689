/// @file Thrust of a vehicle of which nothing is known, in multiples of what carries its weight.
#pragma once

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// Replaces the thrust of a log by multiples of its hover thrust: the commanded force, or a power of duty times battery
/// voltage (1, 1.5 or 2, whichever follows the specific force closest), over its median in flight. The mean of the
/// vertical residual then says nothing. No change where the log has no thrust or gives multiples already.
void use_hover_multiples(Log& log);

}  // namespace swarmcert::logs

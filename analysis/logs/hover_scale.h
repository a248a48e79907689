/// @file Expresses the thrust of an unknown vehicle in multiples of its hover thrust.
#pragma once

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// Replaces the thrust of a log by multiples of its hover thrust. The thrust is the commanded force, or a power of duty
/// times battery voltage (1, 1.5 or 2, whichever follows the specific force most closely), divided by its median in
/// flight. The mean of the vertical residual then carries no information. Does nothing if the log has no thrust or
/// already has multiples.
void use_hover_multiples(Log& log);

}  // namespace swarmcert::logs

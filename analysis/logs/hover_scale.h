/// @file Expresses the thrust of an unknown vehicle in multiples of its hover thrust.
#pragma once

#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

struct HoverScale {
  double hover = 0;    ///< median of the thrust, in its own unit, over the load factor
  double scatter = 0;  ///< robust relative deviation of that ratio; 0 if too few records tell
};

/// @param load specific force along the thrust axis over g, which thrust over weight should equal; NaN where unknown
HoverScale hover_scale(const std::vector<double>& thrust, const std::vector<double>& load);

/// Replaces the thrust of a log by multiples of its hover thrust. The thrust is the commanded force, or a power of duty
/// times battery voltage (1, 1.5 or 2, whichever follows the specific force most closely), divided by its median in
/// flight. The mean of the vertical residual then carries no information. Does nothing if the log has no thrust or
/// already has multiples.
void use_hover_multiples(Log& log);

}  // namespace swarmcert::logs

/// @file Limits in gram-force or newton, independent of the network's own unit.
#pragma once

#include "analysis/gate/evidence.h"

namespace swarmcert::gate {

/// Returns the network's unit of force in the unit of the limit, rounded to nearest; 1 for a limit in the network's
/// own unit.
/// @throws Unfounded if network.toml states no unit.
double force_scale(Evidence& evidence, const Limit& limit);

/// Rounds up or down by at least twice the rounding error of a product with force_scale().
double round_up(double value);
double round_down(double value);

}  // namespace swarmcert::gate

/// @file Limits in gram-force or newton, whatever the network's own unit is.
#pragma once

#include "analysis/gate/evidence.h"

namespace swarmcert::gate {

/// The network's unit of force in the limit's unit, rounded to nearest; 1 for a limit in the network's own unit.
/// @throws Unfounded if network.toml states no unit.
double force_scale(Evidence& evidence, const Limit& limit);

/// The next double above or below: what a product with force_scale() may have lost, twice over.
double round_up(double value);
double round_down(double value);

}  // namespace swarmcert::gate

/// @file Flight regimes in which a residual is evaluated separately.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::residuals {

inline constexpr int kNumVariables = 9;
/// The place over the ground, whose regions depend on where the flights were: PlaceSquares.
inline constexpr int kPlaceVariable = kNumVariables;
/// Returns the name of a variable whose ranges define regions: "height", "speed", ..., "place".
const char* variable_name(int variable);

/// Whether the controller sets the variable: thrust and tilt vary with whatever disturbs the vehicle.
bool is_reaction(int variable);

/// The region of a record for each variable; -1 if it is in none.
using RegionIndices = std::int16_t[kNumVariables];
void regions_of(const stability::Instant& now, double time_in_log_s, RegionIndices indices);

int num_regions(int variable);
/// Describes a region: "below 0.12 m", "0.1 .. 0.2 m/s", "0.2 .. 0.3 m below a vehicle, 0 .. 0.05 m beside its axis".
std::string region_name(int variable, int region);
/// Returns the middle of the region in the unit of the variable; for regions of neighbours, of the lateral distance.
double region_middle(int variable, int region);

}  // namespace swarmcert::residuals

/// @file Regimes of flight: where a residual is looked at separately.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::residuals {

inline constexpr int kNumVariables = 8;
/// "height", "speed", ...: the variables whose ranges make regions.
const char* variable_name(int variable);

/// The region of each variable in which a record lies; -1 where it lies in none.
using RegionIndices = std::int16_t[kNumVariables];
void regions_of(const stability::Instant& now, double time_in_log_s, RegionIndices indices);

int num_regions(int variable);
/// "below 0.12 m", "0.1 .. 0.2 m/s", "0.2 .. 0.3 m below a vehicle, 0 .. 0.05 m beside its axis".
std::string region_name(int variable, int region);
/// Middle of the region, in the variable's unit; lateral distance for those of neighbours.
double region_middle(int variable, int region);

}  // namespace swarmcert::residuals

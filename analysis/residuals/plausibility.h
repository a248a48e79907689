/// @file A track against what its vehicle can do at all: doubts about the log, and records that are cut for them.
#pragma once

#include <vector>

#include "analysis/logs/plausibility.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Doubts that need a model: the battery outside of its range, and a mean thrust far from the weight over the records
/// that are used. Precondition: apply_model().
std::vector<logs::Doubt> doubts_of(const stability::Model& model, const Track& track);

/// Cuts from 0.1 s before to 0.3 s after a record that no flight has: a specific force beyond 1.25 times what the
/// rotors give at full duty and that battery voltage (at least 2 g), a position 0.25 m from where the velocities lead,
/// or a change of velocity that would take such a force three times. Thresholds rest on the vehicle, not on the
/// residual. Nothing with CutRules::keep_impacts.
void cut_impacts(const stability::Model& model, const CutRules& rules, Track& track);

}  // namespace swarmcert::residuals

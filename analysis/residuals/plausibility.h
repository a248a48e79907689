/// @file Checks a track against the capabilities of its vehicle: doubts about the log, and implausible records to cut.
#pragma once

#include <vector>

#include "analysis/logs/plausibility.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Returns the doubts that need a model: the battery voltage is out of range, or the mean thrust over the used records
/// is far from the weight. Precondition: apply_model().
std::vector<logs::Doubt> doubts_of(const stability::Model& model, const Track& track);

/// Cuts from 0.1 s before to 0.3 s after each impossible record: a specific force above 1.25 times what the rotors give
/// at full duty at that battery voltage (at least 2 g), a position 0.25 m away from the integrated velocity, or a
/// change of velocity that requires three times that specific force. The thresholds depend on the vehicle, not on the
/// residual. Does nothing with CutRules::keep_impacts.
void cut_impacts(const stability::Model& model, const CutRules& rules, Track& track);

}  // namespace swarmcert::residuals

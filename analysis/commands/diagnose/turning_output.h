/// @file Effects that turn a vehicle as results and as text.
#pragma once

#include <vector>

#include "analysis/commands/shared/ranking.h"
#include "analysis/identification/diagnose.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::analysis {

/// Appends to the ranking the effects by which body rates are predicted better, with values that have no interval
/// (identification/turning.h), where flights show how the vehicles turn. Prints one line each if `prints`.
/// @param forces what is missing of the force, per model of `inputs`.
void judge_turning(residuals::Inputs inputs, const std::vector<identification::Diagnosis>& forces, int jobs,
                   bool prints, Judgement& judgement);

}  // namespace swarmcert::analysis

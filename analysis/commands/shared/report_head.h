/// @file The head of a page about flights: model, flights and their use, what was left out and why, warnings.
#pragma once

#include "analysis/identification/ladder.h"
#include "analysis/report/report.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::analysis {

/// @param ladder tells which flights were fitted, selected by and held out; null: none was
void add_report_head(Report& report, const residuals::Inputs& inputs, const residuals::Comparison& comparison,
                     const identification::Ladder* ladder);

}  // namespace swarmcert::analysis

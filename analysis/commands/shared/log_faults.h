/// @file Faults of a log itself, clocks and labels, at the end of a ranking.
#pragma once

#include <vector>

#include "nn/base/json.h"

namespace swarmcert::analysis {

/// An entry with its own fields and what all of these have: each is of one vehicle, and of no form of a model.
files::Json fault_entry(files::Json own);

/// To the end of `ranking`. Any makes the verdict missing_effect, unless it is inconclusive.
/// @return whether there are any.
bool rank_faults(const std::vector<files::Json>& entries, files::Json& result);

}  // namespace swarmcert::analysis

/// @file Faults of a log itself, such as clocks and labels, at the end of a ranking.
#pragma once

#include <vector>

#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns an entry with its own fields plus those common to all faults: each belongs to one vehicle and has no model
/// form.
files::Json fault_entry(files::Json own);

/// Appends the entries to `ranking`. Any entry makes the verdict missing_effect, unless the verdict is inconclusive.
/// @return whether there are any.
bool rank_faults(const std::vector<files::Json>& entries, files::Json& result);

}  // namespace swarmcert::analysis

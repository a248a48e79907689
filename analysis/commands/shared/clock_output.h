/// @file Clock offsets as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/clocks/clock_offset.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Appends the offsets to `ranking` as clock_offset, which makes the verdict missing_effect; all earlier entries were
/// judged with the clocks corrected. Prints the offsets if `prints`.
/// @return whether there are any.
bool judge_clocks(const std::vector<identification::ClockOffset>& offsets, bool prints, files::Json& result);

/// Adds "clock_offsets" of add: the same for results without a ranking. Prints the offsets if `prints`.
void add_clocks(const std::vector<identification::ClockOffset>& offsets, bool prints, files::Json& result);

/// Returns "The clock of cf2_00 is ...; all else was judged with it corrected."
std::string sentence(const identification::ClockOffset& offset);

}  // namespace swarmcert::analysis

/// @file Offsets of clocks as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/clocks/clock_offset.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// To the end of `ranking` as clock_offset, which makes the verdict missing_effect; what stands before was judged with
/// the clocks corrected. Prints them where `prints`.
/// @return whether there are any.
bool judge_clocks(const std::vector<identification::ClockOffset>& offsets, bool prints, files::Json& result);

/// "clock_offsets" of add: the same for results without a ranking. Prints them where `prints`.
void add_clocks(const std::vector<identification::ClockOffset>& offsets, bool prints, files::Json& result);

/// "The clock of cf2_00 is ...; all else was judged with it corrected."
std::string sentence(const identification::ClockOffset& offset);

}  // namespace swarmcert::analysis

/// @file Clock offsets as results and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/ranking.h"
#include "analysis/identification/clocks/clock_offset.h"

namespace swarmcert::analysis {

/// Returns the offsets as entries clock_offset; all other entries were judged with the clocks corrected.
std::vector<Ranked> ranked(const std::vector<identification::ClockOffset>& offsets);

/// Describes an entry of `clock_offsets` of add, whose result has no ranking.
void describe_clock(files::Record& record, const identification::ClockOffset& offset);

void print_clock_offsets(const std::vector<identification::ClockOffset>& offsets);

/// Returns "The clock of cf2_00 is ...; all else was judged with it corrected."
std::string sentence(const identification::ClockOffset& offset);

}  // namespace swarmcert::analysis

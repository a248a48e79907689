/// @file What compare says about the logs themselves: cuts, clocks, damage, implausible numbers.
#pragma once

#include "analysis/residuals/comparison.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// {reference, estimated, unknown}: numbers of logs by what is known of their clocks.
files::Json clocks_json(const residuals::Comparison& comparison);

/// "reference": the first log of its flight, to which the others' clocks are related; "estimated"; "unknown": taken
/// as equal, because no common start of a commanded movement gave an offset.
const char* clock_of(const residuals::TrackErrors& track);

/// Records cut, by rule, and what is known of the clocks.
void print_cuts(const residuals::Comparison& comparison);

/// Damaged files, and numbers that no flight has.
void print_doubts(const residuals::Comparison& comparison);

}  // namespace swarmcert::analysis

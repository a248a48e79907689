/// @file Output of compare about the logs themselves: cuts, clocks, damage, implausible values.
#pragma once

#include "analysis/residuals/comparison.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns {reference, estimated, unknown}: the number of logs by the state of their clocks.
files::Json clocks_json(const residuals::Comparison& comparison);

/// Returns "reference" for the first log of its flight, to which the other clocks are related; "estimated"; or
/// "unknown": taken as synchronous, because no common start of a commanded movement gave an offset.
const char* clock_of(const residuals::TrackErrors& track);

/// Prints the records cut, by rule, and the state of the clocks.
void print_cuts(const residuals::Comparison& comparison);

/// Prints damaged files and implausible values.
void print_doubts(const residuals::Comparison& comparison);

}  // namespace swarmcert::analysis

/// @file Output of compare about the logs themselves: cuts, clocks, damage, implausible values.
#pragma once

#include "analysis/residuals/comparison.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Describes the number of logs by the state of their clocks.
void describe_clocks(files::Record& record, const residuals::Comparison& comparison);

/// Returns "reference" for the first log of its flight, to which the other clocks are related; "estimated"; or
/// "unknown": taken as synchronous, because no common start of a commanded movement gave an offset.
const char* clock_of(const residuals::TrackErrors& track);

/// Prints the records cut, by rule, and the state of the clocks.
void print_cuts(const residuals::Comparison& comparison);

/// Prints damaged files and implausible values.
void print_doubts(const residuals::Comparison& comparison);

}  // namespace swarmcert::analysis

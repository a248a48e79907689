/// @file Presentation of a sweep: best and infeasible cells as text, heatmaps and the Pareto front as a report.
#pragma once

#include <string>

#include "stability/sweep/shards.h"

namespace swarmcert::analysis {

void print_sweep(const stability::MergedSweep& sweep);

/// Writes FOLDER/report.html with one heatmap per quantity over the two axes with more than one value (further axes
/// at their first value), a curve if only one axis varies, and the Pareto front.
/// @return the path of the page
std::string write_sweep_report(const stability::MergedSweep& sweep, const std::string& folder,
                               bool overwrite);

}  // namespace swarmcert::analysis

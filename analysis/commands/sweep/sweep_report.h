/// @file How a sweep is shown: best and infeasible cells as text, heatmaps and the Pareto front as a report.
#pragma once

#include <string>

#include "stability/sweep/shards.h"

namespace swarmcert::analysis {

void print_sweep(const stability::MergedSweep& sweep);

/// Writes FOLDER/report.html with one heatmap per quantity (two axes with more than one value; of further axes the
/// first values), a curve where only one axis varies and the Pareto front. @return its path
std::string write_sweep_report(const stability::MergedSweep& sweep, const std::string& folder,
                               bool overwrite);

}  // namespace swarmcert::analysis

/// @file The HTML report of a comparison.
#pragma once

#include <string>

#include "analysis/commands/compare/compare_result.h"
#include "analysis/report/report.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/flown_signals.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with plots, forces in `unit`, and the `described` result. Returns its path.
/// @throws as Report::write().
/// @param flights signals for the page; empty: it holds none
std::string write_compare_report(const CompareResult& result,
                                 const std::vector<residuals::FlownFlight>& flights,
                                 const residuals::ForceUnit& unit, const files::Node& described,
                                 const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis

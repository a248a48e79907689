/// @file The HTML report of a comparison.
#pragma once

#include <string>

#include "analysis/report/report.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with plots, forces in `unit`, and the JSON `result`. Returns its path.
/// @throws as Report::write().
std::string write_compare_report(const residuals::Comparison& comparison, const residuals::Inputs& inputs,
                                 const residuals::ForceUnit& unit, const files::Json& result,
                                 const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis

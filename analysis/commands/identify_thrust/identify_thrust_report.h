/// @file The report of `identify-thrust`: measured thrust and the fitted polynomial.
#pragma once

#include <string>

#include "analysis/identification/thrust/thrust_data.h"
#include "analysis/identification/thrust/thrust_identification.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with the fit, its residuals, the coefficients and the described `result`. Returns its
/// path.
/// @throws files::InputError as Report::write().
std::string write_thrust_report(const ThrustData& data, const ThrustIdentification& found,
                                const files::Node& result, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis

/// @file The report of `iss-check`: how close the runs came to the ball.
#pragma once

#include <string>

#include "analysis/report/table.h"
#include "stability/iss/iss_check.h"

namespace swarmcert::analysis {

/// The runs by kind of disturbance.
Table iss_kinds_table(const files::Node& result);

/// Writes FOLDER/report.html with the ratio of every run and the described `result`. Returns its path.
/// @throws files::InputError as Report::write().
std::string write_iss_check_report(const stability::IssCheck& check, const files::Node& result,
                                   const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis

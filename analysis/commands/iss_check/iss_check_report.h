/// @file The report of `iss-check`: how close the runs came to the ball.
#pragma once

#include <string>

#include "nn/base/json.h"
#include "stability/iss/iss_check.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with the ratio of every run and the JSON `result`. Returns its path.
/// @throws files::InputError as Report::write().
std::string write_iss_check_report(const stability::IssCheck& check, const files::Json& result,
                                   const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis

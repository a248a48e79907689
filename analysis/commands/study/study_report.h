/// @file The page of `study`: one story, pictures first.
#pragma once

#include <string>

#include "analysis/commands/study/study_output.h"

namespace swarmcert::analysis {

/// Writes FOLDER/study.html with its plots, their data and the JSON `result`; returns its path.
/// @throws files::InputError as Report::write().
std::string write_study_report(const identification::Study& study, const ForceUnit& unit,
                               const files::Json& result, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis

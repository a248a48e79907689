/// @file The files that `study` writes into its folder.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/study/study_result.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Creates the folder and writes FOLDER/study.html with the data of its plots, FOLDER/study.json (`document`) and, if
/// an effect was added, FOLDER/fitted.toml. Returns the path of the page.
/// @param notes one sentence per mislabelled log and per clock offset.
/// @throws as Report::write().
std::string write_study_folder(const StudyResult& result, const std::vector<std::string>& notes,
                               const residuals::ForceUnit& unit, const files::Json& document,
                               const std::string& folder);

}  // namespace swarmcert::analysis

/// @file The files that `study` writes into its folder.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/study/study_output.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Creates the folder and writes FOLDER/study.html with the data of its plots, FOLDER/study.json (`result`) and, if
/// an effect was added, FOLDER/fitted.toml. Returns the path of the page.
/// @param notes one sentence per mislabelled log and per clock offset.
/// @param changes the changes relative to --against; may be null.
/// @throws as Report::write().
std::string write_study_folder(const identification::Study& study, const std::vector<std::string>& notes,
                               const Changes* changes, const residuals::ForceUnit& unit,
                               const files::Json& result, const std::string& folder);

}  // namespace swarmcert::analysis

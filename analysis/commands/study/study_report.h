/// @file What `study` leaves in its folder.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/study/study_output.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Writes FOLDER/study.html with the data of its plots, FOLDER/study.json (`result`) and, if an effect was added,
/// FOLDER/fitted.toml; makes the folder. Returns the page's path.
/// @param notes on clocks and labels by which the flights were read, one sentence each.
/// @param changes of --against; may be null. @throws as Report::write().
std::string write_study_folder(const identification::Study& study, const std::vector<std::string>& notes,
                               const Changes* changes, const residuals::ForceUnit& unit,
                               const files::Json& result, const std::string& folder);

}  // namespace swarmcert::analysis

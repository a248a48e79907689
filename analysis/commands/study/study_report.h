/// @file The files that `study` writes into its folder.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/study/study_result.h"
#include "analysis/residuals/flown_signals.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// What was studied, and the signals of the flights that the page holds; empty: none.
struct StudyFlights {
  const residuals::Inputs& inputs;
  std::vector<residuals::FlownFlight> flown;
};

/// @param embeds false: without signals
StudyFlights studied(const identification::Study& study, const residuals::Inputs& inputs, bool embeds);

/// Creates the folder and writes FOLDER/study.html with the data of its plots, FOLDER/study.json (`document`) and, if
/// an effect was added, FOLDER/fitted.toml. Returns the path of the page.
/// @param notes one sentence per mislabelled log and per clock offset.
/// @throws as Report::write().
std::string write_study_folder(const StudyResult& result, const StudyFlights& flights,
                               const std::vector<std::string>& notes, const residuals::ForceUnit& unit,
                               const files::Json& document, const std::string& folder);

}  // namespace swarmcert::analysis

/// @file The report of `add`: the error ladder.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/add/add_output.h"
#include "analysis/commands/shared/before_after.h"
#include "analysis/report/report.h"
#include "analysis/residuals/flown_signals.h"
#include "nn/base/json.h"
#include "stability/model.h"

namespace swarmcert::analysis {

/// The flights under the given model and under the fitted model.
struct BeforeAfter {
  residuals::Comparison before, after;
  identification::PictureData pictures;
  std::vector<residuals::FlownFlight> flights;  ///< empty: the page holds no signals
};

/// Writes FOLDER/report.html with a plot and a table per ladder, the parameters of the effects and the JSON `result`.
/// Returns the path of the page.
/// @param change plots of the change if effects were added, else null
/// @throws files::InputError as Report::write().
std::string write_ladder_report(const std::vector<LadderOfModel>& ladders, const BeforeAfter* change,
                                const residuals::ForceUnit& unit, const files::Json& result,
                                const std::string& folder, bool overwrite);

/// Adds bars and a table of the errors after each step.
void add_ladder_figure(Report& report, const std::vector<stability::LadderRow>& rows, const std::string& name,
                       const residuals::ForceUnit& force);

}  // namespace swarmcert::analysis

/// @file The report of `bound`: tables, and plots of the error inside its bounds over time.
#pragma once

#include <optional>
#include <string>

#include "analysis/commands/bound/disturbance_input.h"
#include "analysis/commands/bound/tube_output.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html and returns its path. Plots: the theorem's transient with the response to a ramp inside
/// the ball; per axis the response to the worst force of the amplitude class inside its tube; the gains and the
/// bounds; the tube around a task. The page embeds the JSON `result`.
/// @throws files::InputError as Report::write().
std::string write_bound_report(const Tracking& input, const LoadedDisturbance& disturbance,
                               const stability::TrackingReport& report,
                               const std::optional<TaskTube>& task_tube, const files::Node& result,
                               const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis

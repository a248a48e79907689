/// @file `bound --tube --task`: the tube around a task, from the command line to JSON, text and a plot.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/bound/disturbance_input.h"
#include "analysis/commands/shared/tracking_input.h"
#include "analysis/tracking/measured_truth.h"
#include "analysis/tracking/tube/local_tube.h"

namespace swarmcert::analysis {

class Report;

struct TubeArguments {
  std::string task;  ///< empty: no tube around a task
  int vehicles = 2;
  double duration_s = 0;            ///< 0: the task's own
  std::vector<double> motor_lag_s;  ///< from, to; empty: as the truth or the gains say
};

/// Declares --task, --vehicles, --duration, --lag-interval.
void declare_tube(CLI::App& app, TubeArguments& arguments);

/// What the flights of --from say that --truth leaves out, for vehicles of `kind`.
/// @throws UsageError where --truth is missing; files::InputError where the file is not of that model, or has too few
///   flights for the level.
MeasuredTruth load_measured_truth(const DisturbanceArguments& disturbance, const std::string& kind,
                                  double level);

/// Reads the network and the truth that `disturbance` names and looks for the tube, with progress.
/// @param measured null: the truth is only declared.
/// @param estimates whose velocity_error and position_error are known; nothing else of it is read.
/// @throws UsageError where network, truth or task are missing or make no sense; files::InputError for bad files.
LocalTube load_local_tube(const TubeArguments& arguments, const DisturbanceArguments& disturbance,
                          const Tracking& tracking, const stability::DisturbanceSource& estimates,
                          const MeasuredTruth* measured, const CommonOptions& common,
                          std::vector<std::string>& inputs);

files::Json local_tube_json(const TubeArguments& arguments, const LocalTube& tube,
                            const MeasuredTruth* measured);
void print_local_tube(const files::Json& tube);
/// Errors allowed over time, per vehicle, inside the radius.
void add_local_tube_plot(Report& report, const LocalTube& tube, const files::Json& json);

}  // namespace swarmcert::analysis

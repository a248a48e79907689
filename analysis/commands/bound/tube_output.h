/// @file `bound --tube --task`: the tube around a task, from the command line to the result, text and a plot.
#pragma once

#include <optional>
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
  std::vector<double> motor_lag_s;  ///< from, to; empty: from the truth or the gains
};

/// Declares --task, --vehicles, --duration, --lag-interval.
void declare_tube(CLI::App& app, TubeArguments& arguments);

/// Calibrates the part of the force that --truth leaves out, from the flights of --from, for vehicles of `kind`.
/// @throws UsageError if --truth is missing; files::InputError if the file was computed with another model or has too
///     few flights for the level.
MeasuredTruth load_measured_truth(const DisturbanceArguments& disturbance, const std::string& kind,
                                  double level);

/// Reads the network and the truth named by `disturbance` and searches for the tube, with progress reports.
/// @param measured null if the truth is only declared.
/// @param estimates only velocity_error and position_error, which must be known, are read.
/// @throws UsageError if network, truth or task are missing or make no sense; files::InputError for invalid files.
LocalTube load_local_tube(const TubeArguments& arguments, const DisturbanceArguments& disturbance,
                          const Tracking& tracking, const stability::DisturbanceSource& estimates,
                          const MeasuredTruth* measured, const CommonOptions& common,
                          std::vector<std::string>& inputs);

struct TaskTube {
  std::string task;
  int vehicles = 2;
  LocalTube tube;
  std::optional<MeasuredTruth> measured;  ///< from the flights of --from
};
void describe(files::Record& record, const TaskTube& result);
void print(const TaskTube& result);
/// Adds a plot of the allowed errors over time, per vehicle, inside the radius.
void add_plot(Report& report, const TaskTube& result);

}  // namespace swarmcert::analysis

/// @file Options shared by the commands on tracking error: gains and model.
#pragma once

#include <string>

#include "analysis/cli/command.h"
#include "stability/bounds/declared_disturbance.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

struct TrackingArguments {
  std::string gains, model;
  double battery_V = stability::kFullBattery_V;
};

/// Declares --gains, --model, --battery.
void declare_tracking(CLI::App& app, TrackingArguments& arguments);

using Tracking = stability::FlownLoop;

/// Calls stability::load_flown_loop() with the declared options.
/// @throws UsageError if the battery voltage is outside the range of the model.
Tracking load_tracking(const TrackingArguments& arguments);

/// Returns what the file declares; without a file, that nothing disturbs the vehicle.
/// @throws files::InputError as stability::read_disturbance_file().
stability::DisturbanceSource load_disturbance_file(const std::string& path);

}  // namespace swarmcert::analysis

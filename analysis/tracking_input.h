/// @file What the commands on tracking error share: gains and model.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/command.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/model.h"

namespace swarmcert::analysis {

struct TrackingArguments {
  std::string gains, model;
  double battery_V = stability::kFullBattery_V;
};

/// Declares --gains, --model, --battery.
void declare_tracking(CLI::App& app, TrackingArguments& arguments);

struct Tracking {
  stability::Gains gains;
  stability::Model model;
  stability::Plant plant;
  std::vector<std::string> notes;  ///< what of the model entered the loop
};

/// Reads both files. The model's effects motor_lag, delay and thrust_ratio enter the loop where gains.toml states no
/// lag or delay of its own.
Tracking load_tracking(const TrackingArguments& arguments);

}  // namespace swarmcert::analysis

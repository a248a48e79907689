/// @file What the commands on tracking error share: gains and model.
#pragma once

#include <string>

#include "analysis/cli/command.h"
#include "stability/bounds/tracking_setup.h"

namespace swarmcert::analysis {

struct TrackingArguments {
  std::string gains, model;
  double battery_V = stability::kFullBattery_V;
};

/// Declares --gains, --model, --battery.
void declare_tracking(CLI::App& app, TrackingArguments& arguments);

using Tracking = stability::TrackingSetup;

/// stability::load_tracking_setup() of what was declared.
/// @throws UsageError if the battery's voltage is outside of the model's range.
Tracking load_tracking(const TrackingArguments& arguments);

}  // namespace swarmcert::analysis

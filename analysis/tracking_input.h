/// @file What the commands on tracking error share: gains, model, and where the numbers of the disturbance come from.
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

struct DisturbanceArguments {
  double rate = -1, amplitude = -1, edge = -1, impulse = -1;  ///< negative: not given
  double bias = 0;
  int passes = 1;
  double every_s = 0, pass_s = 0;
  std::string from;  ///< compare.json
  std::string quantile = "p99";
  std::string certificate;
  files::NetworkArguments network;
  double speed = -1, acceleration = -1;
  int neighbours = 1;
};

void declare_disturbance(CLI::App& app, DisturbanceArguments& arguments);

/// Where the numbers come from, in order: --rate and the like (declared), --from (measured), a certificate or a network
/// with --speed (rate of f_hat).
/// @param inputs files that were read are added
/// @throws UsageError for combinations that mean nothing; files::InputError for bad files.
stability::DisturbanceSource load_disturbance(const DisturbanceArguments& arguments,
                                              std::vector<std::string>& inputs);

}  // namespace swarmcert::analysis

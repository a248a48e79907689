/// @file The sources of the force error: declared, measured, a declared truth, or the Lipschitz constant of a network.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/bound/truth_input.h"

namespace swarmcert::analysis {

struct DisturbanceArguments {
  double rate = -1, amplitude = -1, edge = -1, impulse = -1;  ///< negative: not given
  std::string bias, velocity_error, position_error;  ///< a number for all axes, or X,Y,Z; empty: not given
  std::string file;                                  ///< disturbance.toml
  std::string from;                                  ///< compare.json
  std::string quantile = "p99";
  std::string certificate;
  files::NetworkArguments network;
  std::string truth;                      ///< model.toml whose effects are the true force
  double speed = -1, acceleration = -1;   ///< of a neighbour relative to the vehicle
  double own_speed = -1, own_accel = -1;  ///< of every vehicle
  double thrust_rate = -1;
  double least_height = 0, largest_height = -1;
  double neighbour_mass = 0;  ///< 0: taken from the truth
  std::string gap;            ///< "FROM:TO"
  int neighbours = 1;
};

void declare_disturbance(CLI::App& app, DisturbanceArguments& arguments);

struct LoadedDisturbance {
  stability::DisturbanceSource source;
  std::optional<Truth> truth;
  std::vector<std::string> inputs;  ///< files that were read
};

/// Evaluates the sources in this order: --disturbance, then --rate and the other class options, which replace its
/// numbers (declared), --from (measured), --truth
/// (with the rate of the network if one is given), a certificate or a network with --speed (rate of f_hat, which is
/// not the learning error). Bias and estimation errors are added; without any source they apply to a force error of
/// zero.
/// @throws UsageError for combinations that make no sense; files::InputError for invalid files.
LoadedDisturbance load_disturbance(const DisturbanceArguments& arguments, const Tracking& tracking);

}  // namespace swarmcert::analysis

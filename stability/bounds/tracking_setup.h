/// @file Gains and model together: what the bounds on the tracking error start from.
#pragma once

#include <string>
#include <vector>

#include "stability/bounds/tracking_bounds.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::stability {

struct TrackingSetup {
  Gains gains;
  Model model;
  Plant plant;
  std::vector<std::string> notes;  ///< what of the model entered the loop
};

/// Reads both files. The model's effects motor_lag, delay and thrust_ratio enter the loop where gains.toml states no
/// lag or delay of its own.
/// @param battery_V for the largest thrust.
/// @throws files::InputError as load_gains() and read_model().
TrackingSetup load_tracking_setup(const std::string& gains, const std::string& model,
                                  double battery_V = kFullBattery_V);

}  // namespace swarmcert::stability

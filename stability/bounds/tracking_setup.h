/// @file Gains and model together: the inputs of the bounds on the tracking error.
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
  std::vector<std::string> notes;  ///< which parts of the model entered the loop
};

/// Reads both files. The model's effects motor_lag, delay and thrust_ratio enter the loop if gains.toml states no lag
/// or delay of its own.
/// @param battery_V voltage for the largest thrust.
/// @throws files::InputError like load_gains() and read_model().
TrackingSetup load_tracking_setup(const std::string& gains, const std::string& model,
                                  double battery_V = kFullBattery_V);

}  // namespace swarmcert::stability

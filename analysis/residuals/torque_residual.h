/// @file What a model leaves of the torque: tau_a = J omega' + omega x J omega - tau_u, in B.
#pragma once

#include <string>

#include "analysis/residuals/statistics.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Of the used records of one vehicle.
struct TorqueErrors {
  /// Logs below this rate are refused: the attitude loop runs at 500 Hz, and what it does aliases. At 100 Hz the
  /// published flights give an inertia that is wrong by a factor of 28.
  static constexpr double kLeastRate_hz = 400;

  std::string refused;  ///< why there is none; else empty
  double rate_hz = 0;   ///< of the log
  std::size_t records = 0;
  Axes rmse_Nm, bias_Nm, max_Nm;
};

/// tau_u: thrust map of the rotors' duties, arm, torque per thrust, behind the model's motor lag. omega' is the central
/// difference over three records; tau_u is averaged over the same.
TorqueErrors torque_errors(const stability::Model& model, const Track& track);

}  // namespace swarmcert::residuals

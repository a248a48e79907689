/// @file What a model leaves of the torque: tau = J omega' + omega x J omega - tau_u - tau_a, in B.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/statistics.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Records of one vehicle's track.
struct TorqueResidual {
  /// Logs below this rate are refused: attitude loops run at some hundred hertz, and what they do aliases. At 100 Hz
  /// the published flights, of a loop at 500 Hz, give an inertia that is wrong by a factor of 28.
  static constexpr double kLeastRate_hz = 400;

  std::string refused;  ///< why there is none; else empty
  double rate_hz = 0;   ///< of the log; 0 where it is empty
  std::vector<Eigen::Vector3d>
      torque_B_Nm;  ///< one per record, NaN where omega' is unknown; empty where refused
};

/// tau_u: forces of the rotors by duty and thrust map, or by the motors' commands, at the places of the rotors, behind
/// the model's motor lag; tau_a: the torque of the model's effects. omega' is the central difference over three
/// records; tau_u and tau_a are averaged over the same.
/// @throws files::InputError where an effect of the model cannot be made.
TorqueResidual torque_residual(const stability::Model& model, const Kinds& kinds, const Track& track);

/// As torque_residual(), of logs of any rate: single records of slow logs alias what the attitude loop does, their
/// means over many records say what it balances. Empty where the log has no rates or does not say the force of each
/// rotor.
std::vector<Eigen::Vector3d> torque_records(const stability::Model& model, const Kinds& kinds,
                                            const Track& track);

/// Of the used records of one vehicle.
struct TorqueErrors {
  std::string refused;  ///< why there is none; else empty
  double rate_hz = 0;   ///< of the log
  std::size_t records = 0;
  Axes rmse_Nm, bias_Nm, max_Nm;
  /// Also of slower logs and of logs without rates: minus the mean torque of the rotors in flight slower than this,
  /// which something else must balance.
  static constexpr double kSlow_m_s = 0.1;
  std::size_t slow_records = 0;
  Axes slow_mean_Nm;
};

/// Of torque_residual().
TorqueErrors torque_errors(const stability::Model& model, const Kinds& kinds, const Track& track);

}  // namespace swarmcert::residuals

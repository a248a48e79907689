/// @file Torque residual of a model: tau = J omega' + omega x J omega - tau_u - tau_a, in B.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/residuals/statistics.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Torque residuals of the records of one vehicle's track.
struct TorqueResidual {
  /// Logs below this rate are refused: attitude loops run at several hundred hertz and are aliased. At 100 Hz, the
  /// published flights, with a loop at 500 Hz, give an inertia that is wrong by a factor of 28.
  static constexpr double kLeastRate_hz = 400;

  std::string refused;  ///< why there is none; otherwise empty
  double rate_hz = 0;   ///< of the log; 0 if it is empty
  /// Residual torque, one per record; NaN where omega' is unknown. Empty if refused.
  std::vector<Eigen::Vector3d> torque_B_Nm;
};

/// Returns the torque residual. tau_u are the forces of the rotors at their positions, from duties and the thrust map
/// or from the motor commands, after the model's motor lag; tau_a is the torque of the model's effects. omega' is the
/// central difference over three records; tau_u and tau_a are averaged over the same records.
/// @throws files::InputError if an effect of the model cannot be created.
TorqueResidual torque_residual(const stability::Model& model, const Kinds& kinds, const Track& track);

/// The force of each of the model's rotors, in their order; 0 beyond their number.
using RotorForces = std::array<double, stability::kMostRotors>;

/// Returns whether the log gives the duty, the command or the speed of each of the model's rotors.
bool has_rotor_forces(const stability::Model& model, const Track& track);

/// Returns the forces at `record`, without a motor lag. Precondition: has_rotor_forces().
RotorForces rotor_forces_N(const stability::Model& model, const Track& track, std::size_t record);

/// Returns the torque of the rotors after the model's motor lag, one per record, without the model's other effects.
/// Empty if the log does not give the force of each rotor.
/// @throws files::InputError if the motor lag cannot be created.
std::vector<Eigen::Vector3d> rotor_torques(const stability::Model& model, const Kinds& kinds,
                                           const Track& track);

/// Like torque_residual(), for logs of any rate: single records of slow logs are aliased by the attitude loop, but
/// their means over many records show the torque that it balances. Empty if the log has no rates or does not give the
/// force of each rotor.
std::vector<Eigen::Vector3d> torque_records(const stability::Model& model, const Kinds& kinds,
                                            const Track& track);

/// Torque errors over the used records of one vehicle.
struct TorqueErrors {
  std::string refused;  ///< why there is none; otherwise empty
  double rate_hz = 0;   ///< of the log
  std::size_t records = 0;
  Axes rmse_Nm, bias_Nm, max_Nm;
  /// Also for slower logs and logs without rates: minus the mean rotor torque in flight below this speed, which
  /// something else must balance.
  static constexpr double kSlow_m_s = 0.1;
  std::size_t slow_records = 0;
  Axes slow_mean_Nm;
};

/// Returns the errors of torque_residual().
TorqueErrors torque_errors(const stability::Model& model, const Kinds& kinds, const Track& track);

}  // namespace swarmcert::residuals

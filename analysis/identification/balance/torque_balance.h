/// @file What the rotors balance on average: a centre of mass off the centre, or a constant torque.
///
/// Over a second the rotors' torques cancel what else turns the vehicle: tau_a = b, a constant, or tau_a = -c x T e3,
/// which scales with the thrust T. Means of blocks of 1 s are regressed on both. Where the thrust hardly varies both
/// say the same, and the answer names both. A rotor k that gives the share rho of its thrust leaves (rho - 1) f_k r_k x
/// e3, which scales with the thrust as well: that is a rival in any case.
///
/// A centre of mass counts as off where it is further away than a battery has play (kBatteryPlay_m) and than rotors
/// that differ by kRotorSpread between the sides feign.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// Of the thrust of rotors of one make at one command.
inline constexpr double kRotorSpread = 0.05;

struct TorqueBalance {
  std::string kind, vehicle;
  int flights = 0;
  std::size_t blocks = 0;
  /// Explained by the offset alone, and by the torque alone; 90 % intervals, over blocks of 1 s.
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero(), torque_Nm = Eigen::Vector2d::Zero();
  Eigen::Vector2d offset_half_m = Eigen::Vector2d::Zero(), torque_half_Nm = Eigen::Vector2d::Zero();
  double least_offset_m = 0;  ///< that counts
  /// Forces by which the rotors are off balance, rms over blocks and rotors: as measured, and with the better
  /// explanation.
  double rmse_before_N = 0, rmse_after_N = 0;
  double z = 0;                     ///< of the offset over the torque, by the squares of the blocks
  std::string effect;               ///< com_offset, torque_bias, or empty: nothing counts
  std::vector<std::string> rivals;  ///< what says the same on these flights

  bool is_named() const { return !effect.empty(); }
};

/// Every vehicle of `kind` whose logs say the force of each rotor, over all of its flights. The model's own effects are
/// taken out. Vehicles with fewer than 10 blocks are left out. Does not depend on `jobs`.
std::vector<TorqueBalance> torque_balances(const residuals::Inputs& inputs, const std::string& kind,
                                           int jobs);

/// `effect`, com_offset or torque_bias, with the numbers of `balance` and their intervals, for its vehicle.
stability::EffectSpec spec_of(const TorqueBalance& balance, const std::string& effect);

/// "the centre of mass is 4.0 mm forward and 0.1 mm left of the rotors' centre (90 %: ...)".
std::string in_words(const TorqueBalance& balance);

}  // namespace swarmcert::identification

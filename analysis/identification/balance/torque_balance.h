/// @file Mean torques of the rotors, which show an offset centre of mass or a constant torque.
///
/// Over a second the torques of the rotors cancel all other torques on the vehicle: tau_a = b, a constant, or
/// tau_a = -c x T e3, which is proportional to the thrust T. Means over blocks of 1 s are regressed on both. If the
/// thrust hardly varies, both explain the data equally well and both are reported. A rotor k that gives the fraction
/// rho of its thrust leaves (rho - 1) f_k r_k x e3, which is also proportional to the thrust, so it is always a rival.
///
/// A centre of mass is reported only if its offset is larger than the play of a battery (kBatteryPlay_m) and larger
/// than the apparent offset caused by rotors that differ by kRotorSpread between the sides.
///
/// A constant torque is reported already below this size if it halves the imbalance and explains more than the offset
/// (one-sided test at 1 %): the torque of a battery grows with the thrust. That of unequal rotors need not: if they
/// differ by a constant duty, their forces differ by a multiple of the derivative f' of the thrust map, which grows at
/// least like the root of the force, so at most kConstantPartOfSpread of their torque is constant.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/torque_blocks.h"

namespace swarmcert::identification {

/// Relative spread of the thrust of rotors of the same type at the same command.
inline constexpr double kRotorSpread = 0.05;
/// If a force differs by d f^(1/2) near f_0, it differs by d f_0^(1/2) (1/2 + f / (2 f_0)): half of it is constant.
inline constexpr double kConstantPartOfSpread = 0.5;

struct TorqueBalance {
  std::string kind, vehicle;
  int flights = 0;
  std::size_t blocks = 0;
  /// Estimates with the offset alone and with the torque alone; 90 % intervals from blocks of 1 s.
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero(), torque_Nm = Eigen::Vector2d::Zero();
  Eigen::Vector2d offset_half_m = Eigen::Vector2d::Zero(), torque_half_Nm = Eigen::Vector2d::Zero();
  double longest_offset_m = 0;  ///< the vehicle's arm
  double least_offset_m = 0;    ///< smallest offset that is reported
  double least_torque_Nm = 0;   ///< smallest torque that is reported if it is surely constant
  /// Imbalance of the rotor forces, rms over blocks and rotors: as measured, and with the better explanation.
  double rmse_before_N = 0, rmse_after_N = 0;
  double z = 0;                     ///< of the offset over the torque, from the squared errors of the blocks
  std::string effect;               ///< com_offset, torque_bias, or empty: nothing is reported
  std::vector<std::string> rivals;  ///< alternative explanations of these flights

  bool is_named() const { return !effect.empty(); }
  /// Returns whether the centre of mass may be where the offset alone puts it: not beyond the rotors.
  bool has_offset() const { return offset_m.norm() <= longest_offset_m; }
};

/// Fits both explanations to the blocks of one vehicle, in their order, and decides. Precondition: at least two blocks.
void fit_torques(const std::vector<residuals::TorqueBlock>& blocks, const stability::Model& model,
                 TorqueBalance& balance);

/// Returns the balance of each vehicle of `kind` whose logs give the force of each rotor, over all of its flights. The
/// model's own effects are removed first. Vehicles with fewer than 10 blocks are skipped. Independent of `jobs`.
std::vector<TorqueBalance> torque_balances(const residuals::Inputs& inputs, const std::string& kind,
                                           int jobs);

/// Returns TorqueBalance::rmse_before_N over the blocks of all vehicles; 0 if none has 10 blocks.
double torque_imbalance_N(const residuals::Inputs& inputs, const std::string& kind, int jobs);

/// Returns `effect`, com_offset or torque_bias, with the values and intervals of `balance`, for its vehicle.
stability::EffectSpec spec_of(const TorqueBalance& balance, const std::string& effect);

/// Describes the balance: "the centre of mass is 4.0 mm forward and 0.1 mm left of the rotors' centre (90 %: ...)".
std::string in_words(const TorqueBalance& balance);

}  // namespace swarmcert::identification

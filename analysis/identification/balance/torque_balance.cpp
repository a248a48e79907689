#include "analysis/identification/balance/torque_balance.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/identification/balance/mean_fit.h"
#include "analysis/identification/balance/vehicle_blocks.h"
#include "analysis/identification/candidates.h"
#include "analysis/identification/rotors/rotor_balance.h"
#include "analysis/residuals/torque_blocks.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::TorqueBlock;

constexpr double kTorqueBlock_s = 1;
constexpr std::size_t kFewestTorqueBlocks = 10;

/// Decides which of the two explains the data, and lists alternative explanations.
/// @param is_surely_constant the torque explains most of the means, and surely more than the offset
void decide_torque_cause(double weight_N, bool is_surely_constant, TorqueBalance& balance) {
  constexpr double kSurely_z = 2, kDiagonal = 0.5;
  const std::string constant = stability::plain_effect(stability::Family::kTorque);
  if (is_surely_constant &&
      balance.torque_Nm.norm() - balance.torque_half_Nm.norm() > balance.least_torque_Nm &&
      balance.torque_Nm.norm() <= balance.longest_offset_m * weight_N) {
    balance.effect = constant;
    return;
  }
  const bool is_constant = balance.z < -kSurely_z;
  const Eigen::Vector2d size_m =
      is_constant ? Eigen::Vector2d(balance.torque_Nm / weight_N) : balance.offset_m;
  const Eigen::Vector2d half_m =
      is_constant ? Eigen::Vector2d(balance.torque_half_Nm / weight_N) : balance.offset_half_m;
  if (!(size_m.norm() - half_m.norm() > balance.least_offset_m) || size_m.norm() > balance.longest_offset_m)
    return;
  balance.effect = is_constant ? constant : stability::plain_effect(stability::Family::kLever);
  if (std::abs(balance.z) <= kSurely_z) balance.rivals.push_back(constant);
  const Eigen::Vector2d both = size_m.cwiseAbs();
  if (!is_constant && both.minCoeff() > kDiagonal * both.maxCoeff()) balance.rivals.push_back(rotor_effect());
}

}  // namespace

void fit_torques(const std::vector<TorqueBlock>& blocks, const stability::Model& model,
                 TorqueBalance& balance) {
  std::vector<double> one(blocks.size(), 1), thrust, x, y;
  for (const TorqueBlock& block : blocks) {
    thrust.push_back(block.thrust_N);
    x.push_back(block.torque_B_Nm.x());
    y.push_back(block.torque_B_Nm.y());
  }
  // tau = T (-c_y, c_x)
  const MeanFit offset_x = fit_through_origin(thrust, y), offset_y = fit_through_origin(thrust, x);
  const MeanFit torque_x = fit_through_origin(one, x), torque_y = fit_through_origin(one, y);
  balance.offset_m = {offset_x.value, -offset_y.value};
  balance.offset_half_m = {offset_x.half, offset_y.half};
  balance.torque_Nm = {torque_x.value, torque_y.value};
  balance.torque_half_Nm = {torque_x.half, torque_y.half};
  std::vector<double> gains, losses;
  double before = 0, by_offset = 0, by_torque = 0;
  for (const TorqueBlock& block : blocks) {
    const Eigen::Vector2d tau = block.torque_B_Nm.head<2>();
    const Eigen::Vector2d lever =
        block.thrust_N * Eigen::Vector2d(-balance.offset_m.y(), balance.offset_m.x());
    const double with_offset = (tau - lever).squaredNorm(),
                 with_torque = (tau - balance.torque_Nm).squaredNorm();
    gains.push_back(with_torque - with_offset);
    losses.push_back(with_offset - with_torque);
    before += tau.squaredNorm();
    by_offset += with_offset;
    by_torque += with_torque;
  }
  balance.z = mean_z(gains);
  // Torques tau_x and tau_y correspond to rotor forces +- tau_x / (4 l) +- tau_y / (4 l).
  const double lever_m = model.arm_m * std::sqrt(0.5), count = static_cast<double>(blocks.size());
  balance.rmse_before_N = std::sqrt(before / count) / (4 * lever_m);
  balance.rmse_after_N = std::sqrt(std::min(by_offset, by_torque) / count) / (4 * lever_m);
  balance.longest_offset_m = model.arm_m;
  balance.least_offset_m = kBatteryPlay_m + kRotorSpread * lever_m;
  balance.least_torque_Nm = kConstantPartOfSpread * kRotorSpread * lever_m * model.weight_N();
  constexpr double kQuarter = 0.25;  // of the mean square: the torque halves the imbalance
  const bool is_surely_constant = by_torque <= kQuarter * before && surely_positive(losses, 1);
  decide_torque_cause(model.weight_N(), is_surely_constant, balance);
}

std::vector<TorqueBalance> torque_balances(const residuals::Inputs& inputs, const std::string& kind,
                                           int jobs) {
  return balances_by_vehicle<TorqueBalance, TorqueBlock>(
      inputs, kind, jobs, kFewestTorqueBlocks,
      [&](const residuals::Track& track) -> std::optional<std::vector<TorqueBlock>> {
        auto blocks = residuals::torque_blocks(inputs.model_for(track), inputs.kinds, track, kTorqueBlock_s);
        if (blocks.empty()) return std::nullopt;
        return blocks;
      },
      [&](const std::vector<TorqueBlock>& blocks, TorqueBalance& balance) {
        fit_torques(blocks, *inputs.model_of(kind), balance);
      });
}

double torque_imbalance_N(const residuals::Inputs& inputs, const std::string& kind, int jobs) {
  double squares = 0, blocks = 0;
  for (const TorqueBalance& balance : torque_balances(inputs, kind, jobs)) {
    squares += static_cast<double>(balance.blocks) * balance.rmse_before_N * balance.rmse_before_N;
    blocks += static_cast<double>(balance.blocks);
  }
  return blocks > 0 ? std::sqrt(squares / blocks) : 0;
}

stability::EffectSpec spec_of(const TorqueBalance& balance, const std::string& effect) {
  stability::EffectSpec spec;
  spec.name = effect;
  spec.vehicle = balance.vehicle;
  const bool is_offset = stability::traits_of(effect).family == stability::Family::kLever;
  const Eigen::Vector2d& value = is_offset ? balance.offset_m : balance.torque_Nm;
  const Eigen::Vector2d& half = is_offset ? balance.offset_half_m : balance.torque_half_Nm;
  const std::vector<stability::Parameter>& linear = stability::effect_info(effect).linear;
  for (std::size_t k = 0; k < linear.size(); ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    spec.parameters[linear[k].name] = k < 2 ? value[axis] : 0;
    spec.fit.interval[linear[k].name] =
        k < 2 ? Interval{value[axis] - half[axis], value[axis] + half[axis]} : Interval{0, 0};
  }
  return spec;
}

std::string in_words(const TorqueBalance& balance) {
  const auto and_rivals = [&] {
    std::string text;
    for (const std::string& rival : balance.rivals)
      text += (text.empty() ? "; the same on these flights: " : ", ") + rival;
    return text;
  };
  if (stability::traits_of(balance.effect).family == stability::Family::kTorque) {
    return fmt::format(
        "a constant torque of {:.2e} N m about x and {:.2e} N m about y (90 %: +- {:.1e} and {:.1e}){}",
        balance.torque_Nm.x(), balance.torque_Nm.y(), balance.torque_half_Nm.x(), balance.torque_half_Nm.y(),
        and_rivals());
  }
  if (!balance.has_offset())
    return "no offset centre of mass: to explain the mean torques, it would have to be beyond the rotors";
  return fmt::format(
      "the centre of mass is {:.1f} mm along x and {:.1f} mm along y from the rotors' centre (90 %: +- "
      "{:.1f} and {:.1f} mm){}{}",
      1e3 * balance.offset_m.x(), 1e3 * balance.offset_m.y(), 1e3 * balance.offset_half_m.x(),
      1e3 * balance.offset_half_m.y(),
      balance.is_named()
          ? ""
          : fmt::format("; offsets below {:.1f} mm are not significant", 1e3 * balance.least_offset_m),
      and_rivals());
}

}  // namespace swarmcert::identification

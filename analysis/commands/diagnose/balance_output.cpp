#include "analysis/commands/diagnose/balance_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/identification/balance/motion_balance.h"
#include "analysis/identification/candidates.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using identification::AccelerometerBalance;
using identification::TorqueBalance;

FittedValue fitted(double value, double half) { return {value, Interval{value - half, value + half}}; }

FittedValues offset_of(const TorqueBalance& balance) {
  if (!balance.has_offset()) return {};
  return {{"offset_x_m", fitted(balance.offset_m.x(), balance.offset_half_m.x())},
          {"offset_y_m", fitted(balance.offset_m.y(), balance.offset_half_m.y())}};
}

FittedValues torque_of(const TorqueBalance& balance) {
  return {{"torque_x_Nm", fitted(balance.torque_Nm.x(), balance.torque_half_Nm.x())},
          {"torque_y_Nm", fitted(balance.torque_Nm.y(), balance.torque_half_Nm.y())}};
}

FittedValues scale_of(const AccelerometerBalance& balance) {
  return {{"scale", fitted(balance.scale.value, balance.scale.half)}};
}

/// Turns the result of a balance of means into a ranking entry. Its errors are those of the balance in newton: for
/// torques, the force by which each rotor is off balance; for the accelerometer, mass times the error of its mean.
template <class Balance>
Ranked ranked_balance(const Balance& balance, const std::string& effect,
                      const std::vector<std::string>& rivals) {
  Ranked entry;
  entry.effect = effect;
  entry.kind = balance.kind;
  entry.vehicle = balance.vehicle;
  entry.rmse_before_N = balance.rmse_before_N;
  entry.rmse_after_N = balance.rmse_after_N;
  entry.drop = 1 - balance.rmse_after_N / balance.rmse_before_N;
  entry.equivalence_class = stability::effect_info(effect).equivalence_class;
  for (const std::string& rival : rivals)
    entry.rivals.push_back({{rival}, kUnknown, stability::effect_info(rival).excitation});
  entry.separated_by = stability::effect_info(effect).excitation;
  entry.paired_z = balance.z;
  entry.records = entry.blocks = balance.blocks;
  entry.flights = static_cast<std::size_t>(balance.flights);
  entry.statement = identification::in_words(balance);
  entry.is_sensor = is_sensor_error(effect);
  return entry;
}

Ranked ranked_torque(const TorqueBalance& balance) {
  const bool is_offset = stability::traits_of(balance.effect).family == stability::Family::kLever;
  const bool is_ambiguous = !balance.rivals.empty() &&
                            stability::traits_of(balance.rivals.front()).family == stability::Family::kTorque;
  Ranked entry = ranked_balance(balance, balance.effect, balance.rivals);
  entry.parameters = is_offset ? offset_of(balance) : torque_of(balance);
  if (is_offset && is_ambiguous) entry.equivalence_class = "centre of mass / torque bias / weak rotor";
  return entry;
}

Ranked ranked_accelerometer(const AccelerometerBalance& balance) {
  std::vector<std::string> rivals;
  if (balance.may_be_offset()) rivals.push_back(stability::plain_effect(stability::Family::kPush));
  Ranked entry =
      ranked_balance(balance, stability::effect_shown_by(stability::ShownBy::kAccelerometer), rivals);
  entry.parameters = scale_of(balance);
  if (balance.may_be_offset()) entry.equivalence_class = "accelerometer scale / IMU bias";
  return entry;
}

/// A weak rotor that is in the ranking explains an offset towards it.
bool is_of_named_rotor(const TorqueBalance& balance, const std::vector<Ranked>& ranking) {
  const auto& rivals = balance.rivals;
  if (std::find(rivals.begin(), rivals.end(), identification::rotor_effect()) == rivals.end()) return false;
  return std::any_of(ranking.begin(), ranking.end(), [&](const Ranked& entry) {
    return entry.effect == identification::rotor_effect() && entry.kind == balance.kind;
  });
}

/// The ratio of a thrust_ratio in the ranking; nullptr for other entries.
const FittedValue* ratio_of(const Ranked& entry, const std::string& kind) {
  if (!identification::is_plain_scale(entry.effect) || entry.kind != kind) return nullptr;
  const auto ratio = entry.parameters.find("ratio");
  return ratio == entry.parameters.end() ? nullptr : &ratio->second;
}

/// Returns whether the ranking has a thrust_ratio that each accelerometer of `kind` explains.
bool explain_ratio(const std::vector<AccelerometerBalance>& balances, const std::string& kind,
                   const std::vector<Ranked>& ranking) {
  const auto entry = std::find_if(ranking.begin(), ranking.end(),
                                  [&](const Ranked& r) { return ratio_of(r, kind) != nullptr; });
  if (entry == ranking.end()) return false;
  const FittedValue& ratio = *ratio_of(*entry, kind);
  if (!ratio.interval_90) return false;
  const double half = (ratio.interval_90->upper - ratio.interval_90->lower) / 2;
  return std::all_of(balances.begin(), balances.end(), [&](const AccelerometerBalance& balance) {
    return identification::explains_ratio(balance, ratio.value, half);
  });
}

/// The force residual of a flight shows an accelerometer scale error as a thrust ratio.
bool is_explained_ratio(const Ranked& entry, const AccelerometerBalance& balance) {
  constexpr double kAlike = 0.02;
  const FittedValue* const ratio = ratio_of(entry, balance.kind);
  return ratio != nullptr && std::abs(ratio->value - balance.scale.value) < kAlike;
}

/// Such a model already describes why signals contradict each other.
bool corrects_a_sensor(const stability::Model& model) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [](const stability::EffectSpec& spec) { return is_sensor_error(spec.name); });
}

}  // namespace

std::vector<AccelerometerBalance> judge_accelerometers(const residuals::Inputs& inputs, int jobs, bool prints,
                                                       Judgement& judgement) {
  std::vector<AccelerometerBalance> all, named;
  std::vector<Ranked> ranking;
  for (const stability::Model& model : inputs.models) {
    const std::vector<AccelerometerBalance> balances =
        identification::accelerometer_balances(inputs, model.kind, jobs);
    const bool are_of_ratio = explain_ratio(balances, model.kind, judgement.ranking);
    for (const AccelerometerBalance& balance : balances) {
      all.push_back(balance);
      if (!balance.is_named && !are_of_ratio) continue;
      ranking.push_back(ranked_accelerometer(balance));
      if (prints) fmt::print("  {}: {}\n", balance.vehicle, identification::in_words(balance));
      named.push_back(balance);
    }
  }
  if (named.empty()) return all;
  for (const Ranked& entry : judgement.ranking) {
    const bool is_explained =
        std::any_of(named.begin(), named.end(),
                    [&](const AccelerometerBalance& balance) { return is_explained_ratio(entry, balance); });
    if (!is_explained)
      ranking.push_back(entry);
    else if (prints)
      fmt::print("  the accelerometer explains the thrust_ratio: it is not in the ranking\n");
  }
  judgement.ranking.clear();
  judgement.append(std::move(ranking));
  return all;
}

void describe_accelerometer(files::Record& record, const AccelerometerBalance& balance) {
  record.field("vehicle", balance.vehicle, "");
  record.field("flights", balance.flights, "");
  record.field("blocks", balance.blocks, "Of 1 s.");
  record.field("accelerometer_scale", scale_of(balance), "Measured over modelled; 1: the model is right.");
  record.field("statement", record.is_shape() ? "" : identification::in_words(balance), "It in words.");
}

void judge_motions(const residuals::Inputs& inputs, int jobs, Judgement& judgement,
                   std::vector<std::string>& problems) {
  using identification::Verdict;
  for (const stability::Model& model : inputs.models) {
    for (const identification::MotionFault& fault : identification::motion_faults(inputs, model.kind, jobs)) {
      problems.push_back(fmt::format("{}: signals contradict each other: {}", fault.vehicle, fault.words));
      if (judgement.verdict == Verdict::kNothingMissing && !corrects_a_sensor(model))
        judgement.verdict = Verdict::kUnexplained;
    }
  }
}

std::vector<TorqueBalance> judge_torques(const residuals::Inputs& inputs, int jobs, bool prints,
                                         Judgement& judgement) {
  std::vector<TorqueBalance> all;
  std::vector<Ranked> causes;
  for (const stability::Model& model : inputs.models) {
    for (TorqueBalance& balance : identification::torque_balances(inputs, model.kind, jobs)) {
      if (balance.is_named() && !is_of_named_rotor(balance, judgement.ranking)) {
        causes.push_back(ranked_torque(balance));
        if (prints) fmt::print("  {}: {}\n", balance.vehicle, identification::in_words(balance));
      }
      all.push_back(std::move(balance));
    }
  }
  judgement.append(std::move(causes));
  return all;
}

void describe_torques(files::Record& record, const TorqueBalance& balance) {
  record.field("vehicle", balance.vehicle, "");
  record.field("flights", balance.flights, "");
  record.field("blocks", balance.blocks, "Of 1 s.");
  record.field("com_offset", offset_of(balance), "Empty if it would lie beyond the rotors.");
  record.field("torque_bias", torque_of(balance), "The same torque as a constant one.");
  record.field("least_offset_m", balance.least_offset_m, "A centre of mass counts as off beyond this.", "m");
  record.field("statement", record.is_shape() ? "" : identification::in_words(balance), "It in words.");
}

}  // namespace swarmcert::analysis

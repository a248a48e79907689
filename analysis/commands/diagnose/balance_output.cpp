#include "analysis/commands/diagnose/balance_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/commands/shared/effect_output.h"
#include "analysis/identification/balance/accelerometer_balance.h"
#include "analysis/identification/balance/motion_balance.h"
#include "analysis/identification/balance/torque_balance.h"
#include "analysis/identification/candidates.h"
#include "analysis/identification/verdict.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using identification::AccelerometerBalance;
using identification::TorqueBalance;

files::Json value_json(double value, double half) {
  return {{"value", value}, {"interval_90", {value - half, value + half}}};
}

files::Json offset_json(const TorqueBalance& balance) {
  if (!balance.has_offset()) return files::Json::object();
  return {{"offset_x_m", value_json(balance.offset_m.x(), balance.offset_half_m.x())},
          {"offset_y_m", value_json(balance.offset_m.y(), balance.offset_half_m.y())}};
}

files::Json torque_json(const TorqueBalance& balance) {
  return {{"torque_x_Nm", value_json(balance.torque_Nm.x(), balance.torque_half_Nm.x())},
          {"torque_y_Nm", value_json(balance.torque_Nm.y(), balance.torque_half_Nm.y())}};
}

/// What distinguishes the entries of the two balances.
struct Entry {
  std::string effect, equivalence_class;
  files::Json parameters;
  std::vector<std::string> rivals;
};

/// Turns the result of a balance of means into a ranking entry. Its errors are those of the balance in newton: for
/// torques, the force by which each rotor is off balance; for the accelerometer, mass times the error of its mean.
template <class Balance>
files::Json ranking_entry(const Balance& balance, const Entry& entry) {
  files::Json rivals = files::Json::array();
  for (const std::string& rival : entry.rivals)
    rivals.push_back({{"effect", rival}, {"fly", stability::effect_info(rival).excitation}});
  files::Json json = {{"effect", entry.effect},
                      {"kind", balance.kind},
                      {"vehicle", balance.vehicle},
                      {"rmse_before", balance.rmse_before_N},
                      {"rmse_after", balance.rmse_after_N},
                      {"drop", 1 - balance.rmse_after_N / balance.rmse_before_N},
                      {"drop_ci", {nullptr, nullptr}},
                      {"parameters", entry.parameters},
                      {"per_vehicle", true},
                      {"model_form", files::Json::object()},
                      {"instrument", files::Json::object()},
                      {"class", entry.equivalence_class},
                      {"confounded_with", entry.rivals},
                      {"rivals", rivals},
                      {"separated_by", stability::effect_info(entry.effect).excitation},
                      {"paired_z", balance.z},
                      {"wald_z", nullptr},
                      {"records_in_support", balance.blocks},
                      {"blocks_in_support", balance.blocks},
                      {"flights_in_support", balance.flights},
                      {"statement", identification::in_words(balance)}};
  if (is_sensor_error(entry.effect)) json["sensor"] = true;
  return json;
}

files::Json ranking_entry_of(const TorqueBalance& balance) {
  const bool is_offset = stability::traits_of(balance.effect).family == stability::Family::kLever;
  const bool is_ambiguous = !balance.rivals.empty() &&
                            stability::traits_of(balance.rivals.front()).family == stability::Family::kTorque;
  return ranking_entry(balance,
                       {balance.effect,
                        is_offset && is_ambiguous ? "centre of mass / torque bias / weak rotor"
                                                  : stability::effect_info(balance.effect).equivalence_class,
                        is_offset ? offset_json(balance) : torque_json(balance), balance.rivals});
}

files::Json scale_json(const AccelerometerBalance& balance) {
  return {{"scale", value_json(balance.scale.value, balance.scale.half)}};
}

files::Json ranking_entry_of(const AccelerometerBalance& balance) {
  const bool is_ambiguous = balance.may_be_offset();
  const std::string effect = stability::effect_shown_by(stability::ShownBy::kAccelerometer);
  return ranking_entry(
      balance,
      {effect,
       is_ambiguous ? "accelerometer scale / IMU bias" : stability::effect_info(effect).equivalence_class,
       scale_json(balance),
       is_ambiguous ? std::vector<std::string>{stability::plain_effect(stability::Family::kPush)}
                    : std::vector<std::string>{}});
}

/// A weak rotor that is in the ranking explains an offset towards it.
bool is_of_named_rotor(const TorqueBalance& balance, const files::Json& ranking) {
  const auto& rivals = balance.rivals;
  if (std::find(rivals.begin(), rivals.end(), identification::rotor_effect()) == rivals.end()) return false;
  return std::any_of(ranking.begin(), ranking.end(), [&](const files::Json& entry) {
    return entry["effect"] == identification::rotor_effect() && entry["kind"] == balance.kind;
  });
}

/// Returns whether the ranking has a thrust_ratio that each accelerometer of `kind` explains.
bool explain_ratio(const std::vector<AccelerometerBalance>& balances, const std::string& kind,
                   const files::Json& ranking) {
  const auto ratio = std::find_if(ranking.begin(), ranking.end(), [&](const files::Json& entry) {
    return identification::is_plain_scale(entry["effect"]) && entry["kind"] == kind;
  });
  if (ratio == ranking.end()) return false;
  const files::Json& value = (*ratio)["parameters"]["ratio"];
  const files::Json& interval = value["interval_90"];
  if (!value["value"].is_number() || !interval.is_array()) return false;
  const double half = (interval[1].get<double>() - interval[0].get<double>()) / 2;
  return std::all_of(balances.begin(), balances.end(), [&](const AccelerometerBalance& balance) {
    return identification::explains_ratio(balance, value["value"].get<double>(), half);
  });
}

/// The force residual of a flight shows an accelerometer scale error as a thrust ratio.
bool is_explained_ratio(const files::Json& entry, const AccelerometerBalance& balance) {
  constexpr double kAlike = 0.02;
  if (!identification::is_plain_scale(entry["effect"]) || entry["kind"] != balance.kind) return false;
  const files::Json& ratio = entry["parameters"]["ratio"]["value"];
  return ratio.is_number() && std::abs(ratio.get<double>() - balance.scale.value) < kAlike;
}

/// Such a model already describes why signals contradict each other.
bool corrects_a_sensor(const stability::Model& model) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [](const stability::EffectSpec& spec) { return is_sensor_error(spec.name); });
}

void name_missing(files::Json& result) {
  if (result["verdict"] == identification::name(identification::Verdict::kInconclusive)) return;
  result["verdict"] = identification::name(identification::Verdict::kMissingEffect);
  result.erase("reason");
}

}  // namespace

bool judge_accelerometers(const residuals::Inputs& inputs, int jobs, bool prints, files::Json& result) {
  files::Json ranking = files::Json::array();
  std::vector<AccelerometerBalance> named;
  result["sensors"] = files::Json::array();
  for (const stability::Model& model : inputs.models) {
    std::vector<AccelerometerBalance> balances =
        identification::accelerometer_balances(inputs, model.kind, jobs);
    const bool are_of_ratio = explain_ratio(balances, model.kind, result["ranking"]);
    for (AccelerometerBalance& balance : balances) {
      result["sensors"].push_back({{"vehicle", balance.vehicle},
                                   {"flights", balance.flights},
                                   {"blocks", balance.blocks},
                                   {"accelerometer_scale", scale_json(balance)},
                                   {"statement", identification::in_words(balance)}});
      if (!balance.is_named && !are_of_ratio) continue;
      ranking.push_back(ranking_entry_of(balance));
      if (prints) fmt::print("  {}: {}\n", balance.vehicle, identification::in_words(balance));
      named.push_back(std::move(balance));
    }
  }
  if (named.empty()) return false;
  for (const files::Json& entry : result["ranking"]) {
    const bool is_explained =
        std::any_of(named.begin(), named.end(),
                    [&](const AccelerometerBalance& balance) { return is_explained_ratio(entry, balance); });
    if (!is_explained)
      ranking.push_back(entry);
    else if (prints)
      fmt::print("  the accelerometer explains the thrust_ratio: it is not in the ranking\n");
  }
  result["ranking"] = std::move(ranking);
  name_missing(result);
  return true;
}

bool judge_motions(const residuals::Inputs& inputs, int jobs, files::Json& result) {
  bool is_unexplained = false;
  for (const stability::Model& model : inputs.models) {
    for (const identification::MotionFault& fault : identification::motion_faults(inputs, model.kind, jobs)) {
      is_unexplained = is_unexplained || !corrects_a_sensor(model);
      result["problems"].push_back(
          fmt::format("{}: signals contradict each other: {}", fault.vehicle, fault.words));
    }
  }
  return is_unexplained;
}

bool judge_torques(const residuals::Inputs& inputs, int jobs, bool prints, files::Json& result) {
  bool is_named = false;
  result["torque_balance"] = files::Json::array();
  for (const stability::Model& model : inputs.models) {
    for (const TorqueBalance& balance : identification::torque_balances(inputs, model.kind, jobs)) {
      result["torque_balance"].push_back({{"vehicle", balance.vehicle},
                                          {"flights", balance.flights},
                                          {"blocks", balance.blocks},
                                          {"com_offset", offset_json(balance)},
                                          {"torque_bias", torque_json(balance)},
                                          {"least_offset_m", balance.least_offset_m},
                                          {"statement", identification::in_words(balance)}});
      if (!balance.is_named() || is_of_named_rotor(balance, result["ranking"])) continue;
      is_named = true;
      result["ranking"].push_back(ranking_entry_of(balance));
      if (prints) fmt::print("  {}: {}\n", balance.vehicle, identification::in_words(balance));
    }
  }
  if (is_named) name_missing(result);
  return is_named;
}

}  // namespace swarmcert::analysis

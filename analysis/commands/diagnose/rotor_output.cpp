#include "analysis/commands/diagnose/rotor_output.h"

#include <fmt/core.h>

#include <cmath>

#include "analysis/identification/verdict.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using identification::RotorBalance;

std::vector<double> numbers(const Eigen::Vector4d& four) { return {four.data(), four.data() + four.size()}; }

files::Json factors_json(const RotorBalance& balance) {
  files::Json json = files::Json::object();
  for (std::size_t k = 0; k < balance.factors.size(); ++k) {
    const identification::RotorFactor& factor = balance.factors[k];
    json["rotor_" + std::to_string(k + 1)] = {{"value", factor.value}, {"interval_90", factor.interval}};
  }
  return json;
}

files::Json json_of(const RotorBalance& balance) {
  return {{"vehicle", balance.vehicle},
          {"flight", balance.flight.empty() ? files::Json(nullptr) : files::Json(balance.flight)},
          {"flights", balance.flights},
          {"healthy_flights", balance.healthy_flights},
          {"load_N", numbers(balance.load_N)},
          {"healthy_load_N", numbers(balance.healthy_N)},
          {"rise_N", numbers(balance.rise_N)},
          {"least_rise_N", balance.least_rise_N},
          {"parameters", factors_json(balance)},
          {"rotor", balance.rotor == 0 ? files::Json(nullptr) : files::Json(balance.rotor)},
          {"statement", identification::in_words(balance)}};
}

/// Returns the ranking entry: its errors are those of the four rotor loads, relative to healthy flights.
files::Json ranking_entry(const RotorBalance& balance, const std::string& kind) {
  Eigen::Vector4d left_N = balance.rise_N;
  left_N[balance.rotor - 1] = 0;
  const double before_N = balance.rise_N.norm() / 2, after_N = left_N.norm() / 2;
  const stability::EffectInfo& info = stability::effect_info(identification::rotor_effect());
  return {{"effect", info.name},
          {"kind", kind},
          {"vehicle", balance.vehicle},
          {"rmse_before", before_N},
          {"rmse_after", after_N},
          {"drop", 1 - after_N / before_N},
          {"drop_ci", {nullptr, nullptr}},
          {"parameters", factors_json(balance)},
          {"per_vehicle", true},
          {"model_form", files::Json::object()},
          {"instrument", files::Json::object()},
          {"class", info.equivalence_class},
          {"confounded_with", {"payload"}},
          {"rivals", {{{"effect", "payload"}, {"fly", info.excitation}}}},
          {"separated_by", info.excitation},
          {"paired_z", nullptr},
          {"wald_z", nullptr},
          {"records_in_support", balance.records},
          {"blocks_in_support", balance.flights},
          {"flights_in_support", balance.flights},
          {"rotor", balance.rotor},
          {"statement", identification::in_words(balance)}};
}

}  // namespace

void print_rotors(const std::vector<RotorBalance>& balances) {
  int of_vehicle = 0;
  for (const RotorBalance& balance : balances) {
    if (balance.flight.empty()) {
      of_vehicle = balance.rotor;
      fmt::print("  {}: {} ({} flights, {} healthy)\n", balance.vehicle, identification::in_words(balance),
                 balance.flights, balance.healthy_flights);
    } else if (balance.rotor != of_vehicle) {
      fmt::print("    {}: {}\n", balance.flight, identification::in_words(balance));
    }
  }
}

bool add_rotors(const std::vector<RotorBalance>& balances, const std::string& kind, files::Json& result) {
  files::Json ranking = files::Json::array();
  files::Json& rotors = result["rotors"];
  if (rotors.is_null()) rotors = files::Json::array();
  for (const RotorBalance& balance : balances) {
    rotors.push_back(json_of(balance));
    if (balance.flight.empty() && balance.rotor != 0) ranking.push_back(ranking_entry(balance, kind));
  }
  const bool is_named = !ranking.empty();
  for (files::Json& entry : result["ranking"]) ranking.push_back(std::move(entry));
  result["ranking"] = std::move(ranking);
  if (is_named) {
    result["verdict"] = identification::name(identification::Verdict::kMissingEffect);
    result.erase("reason");
  }
  return is_named;
}

bool judge_rotors(const residuals::Inputs& inputs, const residuals::Inputs& healthy, int jobs, bool prints,
                  files::Json& result) {
  bool is_named = false;
  for (const stability::Model& model : inputs.models) {
    const std::vector<RotorBalance> balances =
        identification::rotor_balances(identification::rotor_loads(inputs, model.kind, jobs),
                                       identification::rotor_loads(healthy, model.kind, jobs), model);
    if (prints) print_rotors(balances);
    is_named = add_rotors(balances, model.kind, result) || is_named;
  }
  return is_named;
}

}  // namespace swarmcert::analysis

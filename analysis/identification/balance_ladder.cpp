#include "analysis/identification/balance_ladder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/identification/torque_balance.h"

namespace swarmcert::identification {
namespace {

constexpr double kLeastFallOfBalance = 0.005;

residuals::Inputs with_model(residuals::Inputs inputs, const std::vector<stability::EffectSpec>& specs,
                             const std::vector<int>& which) {
  std::vector<residuals::FlightFiles> flights;
  for (const int i : which) flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  inputs.found.flights = std::move(flights);
  for (stability::Model& model : inputs.models) model = with_effects(model, specs);
  for (auto& [vehicle, model] : inputs.vehicle_models) model = with_effects(model, specs);
  return inputs;
}

/// Over all vehicles; 0 where none has ten blocks.
double imbalance_of(const residuals::Inputs& inputs, int jobs) {
  double squares = 0, blocks = 0;
  for (const TorqueBalance& balance : torque_balances(inputs, inputs.models[0].kind, jobs)) {
    squares += static_cast<double>(balance.blocks) * balance.rmse_before_N * balance.rmse_before_N;
    blocks += static_cast<double>(balance.blocks);
  }
  return blocks > 0 ? std::sqrt(squares / blocks) : 0;
}

std::vector<stability::EffectSpec> specs_of(const std::vector<TorqueBalance>& balances,
                                            const std::string& effect) {
  std::vector<stability::EffectSpec> specs;
  for (const TorqueBalance& balance : balances) {
    stability::EffectSpec spec;
    spec.name = effect;
    if (balances.size() > 1) spec.vehicle = balance.vehicle;
    const auto set = [&](const char* name, double value, double half) {
      spec.parameters[name] = value;
      spec.fit.interval[name] = {value - half, value + half};
    };
    if (effect == "com_offset") {
      set("offset_x_m", balance.offset_m.x(), balance.offset_half_m.x());
      set("offset_y_m", balance.offset_m.y(), balance.offset_half_m.y());
    } else {
      set("torque_x_Nm", balance.torque_Nm.x(), balance.torque_half_Nm.x());
      set("torque_y_Nm", balance.torque_Nm.y(), balance.torque_half_Nm.y());
      set("torque_z_Nm", 0, 0);
    }
    specs.push_back(std::move(spec));
  }
  return specs;
}

std::map<std::string, double> values_of_effects(const stability::Model& model) {
  std::map<std::string, double> values;
  for (const stability::EffectSpec& spec : model.effects) {
    const std::string prefix = spec.name + (spec.vehicle.empty() ? "" : "@" + spec.vehicle) + ".";
    for (const auto& [name, value] : spec.parameters) values[prefix + name] = value;
  }
  return values;
}

}  // namespace

bool is_balanced(const std::string& effect) { return effect == "com_offset" || effect == "torque_bias"; }

Ladder balance_ladder(const residuals::Inputs& inputs, const std::string& effect, bool keep_anyway,
                      int jobs) {
  Ladder ladder;
  const stability::Model& nominal = inputs.models[0];
  ladder.split = split_flights(inputs);
  ladder.earlier = nominal.ladder;
  const std::vector<TorqueBalance> balances =
      torque_balances(with_model(inputs, {}, ladder.split.fit), nominal.kind, jobs);
  if (balances.empty()) {
    ladder.too_poor = "no vehicle has ten seconds of flight with the force of each rotor";
    return ladder;
  }
  std::vector<stability::EffectSpec> specs = specs_of(balances, effect);
  for (stability::EffectSpec& spec : specs) {
    for (const int i : ladder.split.fit)
      spec.fit.flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)].name);
  }
  int looks = 0;
  for (const stability::LadderRow& row : ladder.earlier) looks = std::max(looks, row.test_looks);
  ladder.test_looks = looks + 1;
  for (const bool has_effect : {false, true}) {
    const std::vector<stability::EffectSpec> added =
        has_effect ? specs : std::vector<stability::EffectSpec>{};
    const auto error_N = [&](const std::vector<int>& which) {
      return imbalance_of(with_model(inputs, added, which), jobs);
    };
    stability::LadderRow row;
    row.effect = has_effect ? effect : "nominal";
    row.fit_rmse_N = error_N(ladder.split.fit);
    row.select_rmse_N = error_N(ladder.split.select);
    row.test_rmse_N = error_N(ladder.split.test);
    row.test_looks = ladder.test_looks;
    row.values = values_of_effects(with_effects(nominal, added));
    ladder.rows.push_back(std::move(row));
  }
  stability::LadderRow& last = ladder.rows.back();
  const double before_N = ladder.rows.front().select_rmse_N;
  const bool helps = last.select_rmse_N <= (1 - kLeastFallOfBalance) * before_N && before_N > 0;
  if (!helps)
    last.note = fmt::format("the rotors of the select flights are off balance by {:.6f}, then by {:.6f} N",
                            before_N, last.select_rmse_N);
  last.accepted = ladder.any_accepted = helps || keep_anyway;
  for (stability::EffectSpec& spec : specs) {
    spec.fit.select_rmse_before_N = before_N;
    spec.fit.select_rmse_after_N = last.select_rmse_N;
    spec.fit.test_looks = ladder.test_looks;
    if (!helps) spec.fit.note = "kept although " + last.note;
  }
  ladder.is_tested = last.test_rmse_N > 0;
  ladder.model = ladder.any_accepted ? with_effects(nominal, specs) : nominal;
  ladder.model.ladder = ladder.earlier;
  ladder.model.ladder.insert(ladder.model.ladder.end(), ladder.rows.begin(), ladder.rows.end());
  return ladder;
}

}  // namespace swarmcert::identification

#include "analysis/identification/balance/balance_ladder.h"

#include <algorithm>
#include <cmath>

#include "analysis/identification/balance/accelerometer_balance.h"
#include "analysis/identification/balance/torque_balance.h"
#include "analysis/residuals/comparison.h"
#include "stability/effects/registry.h"

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

double error_of(const residuals::Inputs& inputs, const std::string& effect, int jobs) {
  if (is_of_torques(effect)) return torque_imbalance_N(inputs, inputs.models[0].kind, jobs);
  return residuals::compare(inputs, jobs, [](int, int) {}).overall.statistics.rmse.total;
}

/// Returns one effect per vehicle; that of a single vehicle applies to all.
std::vector<stability::EffectSpec> fitted_to_means(const residuals::Inputs& inputs, const std::string& effect,
                                                   int jobs) {
  const std::string& kind = inputs.models[0].kind;
  std::vector<stability::EffectSpec> specs;
  if (is_of_torques(effect)) {
    for (const TorqueBalance& balance : torque_balances(inputs, kind, jobs))
      specs.push_back(spec_of(balance, effect));
  } else {
    for (const AccelerometerBalance& balance : accelerometer_balances(inputs, kind, jobs))
      specs.push_back(spec_of(balance));
  }
  if (specs.size() == 1) specs[0].vehicle.clear();
  return specs;
}

}  // namespace

bool is_of_torques(const std::string& effect) {
  return stability::traits_of(effect).shown_by == stability::ShownBy::kTorques;
}

bool is_balanced(const std::string& effect) {
  return is_of_torques(effect) || stability::traits_of(effect).shown_by == stability::ShownBy::kAccelerometer;
}

Ladder balance_ladder(residuals::Inputs inputs, const std::string& effect, bool keep_anyway, int jobs) {
  Ladder ladder;
  const stability::Model& nominal = inputs.models[0];
  ladder.split = split_flights(inputs);
  for (const residuals::FlightFiles& flight : inputs.found.flights) ladder.flights.push_back(flight.name);
  ladder.earlier = nominal.ladder;
  std::vector<stability::EffectSpec> specs =
      fitted_to_means(with_model(inputs, {}, ladder.split.fit), effect, jobs);
  if (specs.empty()) {
    ladder.too_poor = is_of_torques(effect)
                          ? "no vehicle has ten seconds of flight with the force of each rotor"
                          : "no vehicle has ten seconds of flight with an accelerometer and a velocity";
    return ladder;
  }
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
      return error_of(with_model(inputs, added, which), effect, jobs);
    };
    stability::LadderRow row;
    row.effect = has_effect ? effect : "nominal";
    row.fit_rmse_N = error_N(ladder.split.fit);
    row.select_rmse_N = error_N(ladder.split.select);
    if (ladder.split.by != Split::By::kNothing) row.test_rmse_N = error_N(ladder.split.test);
    row.test_looks = ladder.test_looks;
    row.values = ladder_values(with_effects(nominal, added));
    ladder.rows.push_back(std::move(row));
  }
  stability::LadderRow& last = ladder.rows.back();
  const double before_N = ladder.rows.front().select_rmse_N;
  const bool helps = last.select_rmse_N <= (1 - kLeastFallOfBalance) * before_N && before_N > 0;
  if (!helps)
    last.note = too_small_fall(is_of_torques(effect) ? "the imbalance of the rotors" : "the error", before_N,
                               last.select_rmse_N, kLeastFallOfBalance);
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

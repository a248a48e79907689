#include "analysis/identification/budget.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/identification/kind_fit.h"
#include "analysis/residuals/published_vehicle.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Inputs;
using stability::EffectSpec;
using stability::Model;

EffectSpec offset_spec(const Eigen::Vector3d& offset_N) {
  EffectSpec spec;
  spec.name = stability::plain_effect(stability::Family::kPush);
  spec.parameters = {{"force_x_N", offset_N.x()}, {"force_y_N", offset_N.y()}, {"force_z_N", offset_N.z()}};
  return spec;
}

BudgetRow judged(const std::string& name, const Inputs& test, int jobs) {
  const residuals::Comparison comparison = residuals::compare(test, jobs, [](int, int) {});
  BudgetRow row;
  row.name = name;
  for (const auto& [composition, group] : comparison.compositions) row.of[composition] = group.statistics;
  for (const auto& [kind, group] : comparison.kinds) row.of["kind " + kind] = group.statistics;
  row.of["all"] = comparison.overall.statistics;
  return row;
}

void set_mass(Inputs& inputs, const std::string& kind, double mass_kg) {
  for (Model& model : inputs.models) {
    if (model.kind == kind) model.mass_kg = mass_kg;
  }
}

/// Returns the vertical error of the vehicles of `kind`; infinite if there are none.
double error_N(const Inputs& inputs, const std::string& kind, int jobs) {
  const BudgetRow row = judged("nominal", inputs, jobs);
  const auto found = row.of.find("kind " + kind);
  return found == row.of.end() ? INFINITY : found->second.rmse.z;
}

/// Assigns the published mass to each published kind for which it gives a smaller vertical residual on the fit flights
/// than the mass of its model.
void choose_masses(Inputs& fit, Inputs& test, int jobs) {
  for (const Model& model : std::vector<Model>(fit.models)) {
    const residuals::PublishedVehicle* const published = residuals::published_vehicle(model.kind);
    if (published == nullptr || published->mass_kg == model.mass_kg) continue;
    Inputs other = fit;
    set_mass(other, model.kind, published->mass_kg);
    if (!(error_N(other, model.kind, jobs) < error_N(fit, model.kind, jobs))) continue;
    for (Inputs* inputs : {&fit, &test}) set_mass(*inputs, model.kind, published->mass_kg);
  }
}

/// Returns the vehicles of `kind` in `inputs`.
std::set<std::string> vehicles_of(const Inputs& inputs, const std::string& kind) {
  std::set<std::string> names;
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      if (use_of(inputs, vehicle).kind == kind) names.insert(vehicle);
    }
  }
  return names;
}

/// Gives the vehicles of the model's kind in `inputs` the model with the fitted values of the stage's effects.
void apply(const residuals::PublishedStage& stage, const KindFit& joint, const Model& model, Inputs& inputs) {
  for (const std::string& vehicle : vehicles_of(inputs, model.kind)) {
    Model own = model;
    own.effects = joint.specs({stage.effects.begin(), stage.effects.end()});
    const auto offset = joint.offsets_N().find(vehicle);
    if (stage.has_offsets && offset != joint.offsets_N().end())
      own.effects.push_back(offset_spec(offset->second));
    inputs.vehicle_models[vehicle] = std::move(own);
  }
}

/// Makes the model of each kind consist of the learned force alone, with the mass used to train the network.
Inputs with_network(Inputs inputs, const std::string& network) {
  inputs.rules.published_signals = true;
  for (Model& model : inputs.models) {
    if (const auto* published = residuals::published_vehicle(model.kind)) model.mass_kg = published->mass_kg;
    model.effects.clear();
    residuals::set_network(model, network);
  }
  return inputs;
}

}  // namespace

Budget error_budget(const Inputs& given_fit, const Inputs& given_test, const std::string& network, int jobs,
                    const residuals::Progress& progress) {
  constexpr int kPasses = 12, kRestPasses = 6;
  Budget budget;
  budget.fit_flights = given_fit.found.flights.size();
  budget.test_flights = given_test.found.flights.size();
  Inputs fit = given_fit, test = given_test;
  for (Inputs* inputs : {&fit, &test}) {
    inputs->vehicle_models.clear();
    for (Model& model : inputs->models) model.effects.clear();
  }
  choose_masses(fit, test, jobs);
  budget.rows.push_back(judged("nominal", test, jobs));
  const int work = static_cast<int>(test.models.size()) * (kPasses + kRestPasses);
  int done = 0;
  const auto show = [&](int, int) { progress(++done, work); };
  const std::vector<residuals::PublishedStage>& stages = residuals::published_stages();
  const std::size_t last = stages.size() - 1;
  std::vector<Inputs> staged(stages.size(), test);
  for (const Model& model : test.models) {
    budget.masses_kg[model.kind] = model.mass_kg;
    KindFit joint(fit, model.kind, jobs);
    if (joint.is_empty()) continue;
    const std::vector<std::string>& known = stages[last - 1].effects;
    joint.add(known);
    joint.search(kPasses, show);
    for (std::size_t k = 0; k < last; ++k) apply(stages[k], joint, model, staged[k]);
    joint.add({stages[last].effects.begin() + known.size(), stages[last].effects.end()});
    joint.search(kRestPasses, show);
    apply(stages[last], joint, model, staged[last]);
  }
  for (std::size_t k = 0; k < stages.size(); ++k) {
    budget.rows.push_back(judged(stages[k].name, staged[k], jobs));
    budget.rows.back().models = staged[k].vehicle_models;
  }
  budget.fitted = staged[last].vehicle_models;
  if (!network.empty()) budget.rows.push_back(judged("network", with_network(test, network), jobs));
  return budget;
}

}  // namespace swarmcert::identification

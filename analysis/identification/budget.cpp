#include "analysis/identification/budget.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "analysis/identification/kind_fit.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Inputs;
using stability::EffectSpec;
using stability::Model;

const std::vector<std::string> kKnown = {"motor_lag", "ground", "downwash"};
const std::vector<std::string> kRest = {"upper_lift", "drag_linear", "battery", "inflow"};

EffectSpec offset_spec(const Eigen::Vector3d& offset_N) {
  EffectSpec spec;
  spec.name = "constant_force";
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

/// What the networks' authors weighed.
constexpr double kWeighedSmall_kg = 0.032;

/// The mass of a kind "small", its model's or kWeighedSmall_kg, that leaves less vertical residual on the flights that
/// are fitted; 0 where these hold no such vehicle.
double better_small_mass_kg(const Inputs& fit, int jobs) {
  const Model* const small = fit.model_of("small");
  if (small == nullptr) return 0;
  Inputs lighter = fit;
  set_mass(lighter, "small", kWeighedSmall_kg);
  const auto error_N = [jobs](const Inputs& inputs) {
    const BudgetRow row = judged("nominal", inputs, jobs);
    const auto found = row.of.find("kind small");
    return found == row.of.end() ? INFINITY : found->second.rmse.z;
  };
  const double stated_N = error_N(fit), weighed_N = error_N(lighter);
  if (std::isinf(stated_N) && std::isinf(weighed_N)) return 0;
  return weighed_N < stated_N ? kWeighedSmall_kg : small->mass_kg;
}

/// Vehicles of `kind` in `inputs`.
std::set<std::string> vehicles_of(const Inputs& inputs, const std::string& kind) {
  std::set<std::string> names;
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      if (use_of(inputs, vehicle).kind == kind) names.insert(vehicle);
    }
  }
  return names;
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
  if (const double mass_kg = better_small_mass_kg(fit, jobs); mass_kg > 0) {
    set_mass(fit, "small", mass_kg);
    set_mass(test, "small", mass_kg);
  }
  budget.rows.push_back(judged("nominal", test, jobs));
  const int kinds = static_cast<int>(test.models.size());
  const int work = kinds * (kPasses + kRestPasses);
  int done = 0;
  std::vector<Inputs> stages(5, test);  // lag, offset, ground, jet, rest
  for (const Model& model : test.models) {
    budget.masses_kg[model.kind] = model.mass_kg;
    KindFit joint(fit, model.kind, jobs);
    if (joint.is_empty()) continue;
    const auto show = [&](int, int) { progress(++done, work); };
    joint.add(kKnown);
    joint.search(kPasses, show);
    const auto apply = [&](Inputs& stage, const std::set<std::string>& names, bool offsets) {
      for (const std::string& vehicle : vehicles_of(test, model.kind)) {
        Model own = model;
        own.effects = joint.specs(names);
        const auto offset = joint.offsets_N().find(vehicle);
        if (offsets && offset != joint.offsets_N().end()) own.effects.push_back(offset_spec(offset->second));
        stage.vehicle_models[vehicle] = std::move(own);
      }
    };
    apply(stages[0], {"motor_lag"}, false);
    apply(stages[1], {"motor_lag"}, true);
    apply(stages[2], {"motor_lag", "ground"}, true);
    apply(stages[3], {"motor_lag", "ground", "downwash"}, true);
    joint.add(kRest);
    joint.search(kRestPasses, show);
    std::set<std::string> everything(kKnown.begin(), kKnown.end());
    everything.insert(kRest.begin(), kRest.end());
    apply(stages[4], everything, true);
    for (const std::string& vehicle : vehicles_of(test, model.kind))
      budget.fitted[vehicle] = stages[4].vehicle_models.at(vehicle);
  }
  const char* const kNames[] = {"lag", "offset", "ground", "jet", "rest"};
  for (std::size_t k = 0; k < stages.size(); ++k) {
    budget.rows.push_back(judged(kNames[k], stages[k], jobs));
    budget.rows.back().models = stages[k].vehicle_models;
  }
  if (!network.empty()) {
    Inputs learned = test;
    learned.rules.published_signals = true;
    for (Model& model : learned.models) {
      if (model.kind == "small") model.mass_kg = kWeighedSmall_kg;
      EffectSpec spec;
      spec.name = "deep_set";
      spec.network = std::filesystem::absolute(network).string();
      model.effects = {spec};
    }
    budget.rows.push_back(judged("network", learned, jobs));
  }
  return budget;
}

}  // namespace swarmcert::identification

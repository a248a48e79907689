#include "analysis/residuals/inputs.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/plausibility.h"
#include "analysis/residuals/published_vehicle.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"
#include "nn/weights/network.h"

namespace swarmcert::residuals {
namespace {

void add_kind(Kinds& kinds, const std::string& kind, double mass_kg) {
  const int index = kinds.index(kind);
  if (index >= 0) {
    kinds.masses_kg[static_cast<std::size_t>(index)] = mass_kg;
    return;
  }
  kinds.names.push_back(kind);
  kinds.masses_kg.push_back(mass_kg);
}

void set_published_mass(stability::Model& model) {
  if (const auto* published = published_vehicle(model.kind)) model.mass_kg = published->mass_kg;
}

/// Uses the fleet's models: the first one of each kind, and separate ones for vehicles that differ from it.
void use_fleet_models(Inputs& inputs, const std::map<std::string, std::string>& flown) {
  std::map<std::string, std::string> of_kind;
  std::set<std::string> named;
  for (const auto& [vehicle, path] : flown) {
    const stability::Model model = stability::read_model(path);
    const auto [first, is_new] = of_kind.emplace(model.kind, path);
    if (is_new)
      inputs.models.push_back(model);
    else if (first->second != path)
      inputs.vehicle_models[vehicle] = model;
    if (named.insert(path).second) inputs.named_files.push_back(path);
  }
}

/// Returns a model of 1 kg whose rotors are never asked for a force, as the log's thrust is in multiples of the weight.
stability::Model unit_model() {
  stability::Model model;
  model.kind = "unknown";
  model.mass_kg = 1;
  model.inertia_kg_m2 = {1, 1, 1};
  model.arm_m = model.torque_per_thrust_m = 1;
  return model;
}

void use_log_rules(Inputs& inputs) {
  for (const FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      const LogRule rule = rule_for(inputs.log_rules, path);
      if (!rule.gains.empty()) inputs.log_gains[path] = stability::load_gains(rule.gains);
      if (rule.mass_kg > 0) inputs.log_masses_kg[path] = rule.mass_kg;
      if (!rule.model.empty()) inputs.log_models[path] = stability::read_model(rule.model);
    }
  }
}

void read_models(const std::vector<std::string>& paths, Inputs& inputs) {
  for (const std::string& path : paths) {
    inputs.models.push_back(stability::read_model(path));
    inputs.named_files.push_back(path);
    const std::string& kind = inputs.models.back().kind;
    for (std::size_t i = 0; i + 1 < inputs.models.size(); ++i) {
      if (inputs.models[i].kind != kind) continue;
      throw files::InputError({path, "", "vehicle.kind", kind,
                               "is the kind of " + inputs.models[i].path + " as well",
                               "give one model per kind"});
    }
  }
}

/// Returns the models of the fleet's vehicles that flew.
std::map<std::string, std::string> flown_models(const Inputs& inputs) {
  std::map<std::string, std::string> models;
  for (const FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      const auto known = inputs.fleet.find(vehicle);
      if (known != inputs.fleet.end()) models[vehicle] = known->second.model;
    }
  }
  return models;
}

/// Uses the models of single logs if no other models are given: the first of each kind becomes the model of the kind.
void use_log_models(Inputs& inputs) {
  for (const auto& [path, model] : inputs.log_models) {
    if (inputs.model_of(model.kind) == nullptr) inputs.models.push_back(model);
  }
  inputs.has_only_log_models = !inputs.models.empty();
}

/// Chooses models if none is given: those of the fleet, those of single logs or, if allowed, a model of 1 kg.
void use_other_models(const InputArguments& arguments, const std::map<std::string, std::string>& flown,
                      Inputs& inputs) {
  use_fleet_models(inputs, flown);
  if (inputs.models.empty()) use_log_models(inputs);
  if (!inputs.models.empty()) return;
  if (!arguments.may_lack_model) {
    throw files::InputError({arguments.flights.empty() ? "" : arguments.flights[0], "", "MODEL", "",
                             "no model is named and no vehicle is known",
                             "give a model.toml ('swarmcert model draft' writes one), or a flights.toml "
                             "(--flights) that names one per vehicle"});
  }
  inputs.rules.per_mass = true;
  inputs.models.push_back(unit_model());
}

/// Sets the network and the published mass in each model.
void complete_models(const InputArguments& arguments, Inputs& inputs) {
  const auto complete = [&](stability::Model& model) {
    if (!arguments.network.empty()) set_network(model, arguments.network);
    if (arguments.rules.has_published_signals()) set_published_mass(model);
  };
  for (stability::Model& model : inputs.models) complete(model);
  for (auto& [vehicle, model] : inputs.vehicle_models) complete(model);
  for (auto& [path, model] : inputs.log_models) complete(model);
  if (arguments.network.empty()) return;
  inputs.named_files.push_back(arguments.network);
  files::NetworkArguments network;
  network.file = arguments.network;
  const files::Network loaded = files::load_network(network);
  for (const auto& [name, weights] : files::parts(loaded)) inputs.named_files.push_back(weights->path);
}

}  // namespace

void set_network(stability::Model& model, const std::string& network) {
  auto& effects = model.effects;
  effects.erase(std::remove_if(effects.begin(), effects.end(),
                               [](const stability::EffectSpec& e) { return e.name == "deep_set"; }),
                effects.end());
  stability::EffectSpec spec;
  spec.name = "deep_set";
  spec.network = std::filesystem::absolute(network).string();
  effects.push_back(std::move(spec));
}

Inputs read_inputs(const InputArguments& arguments) {
  Inputs inputs;
  inputs.rules = arguments.rules;
  inputs.map = arguments.columns.empty() ? logs::SignalMap() : logs::read_columns(arguments.columns);
  if (!arguments.columns.empty()) inputs.named_files.push_back(arguments.columns);
  if (!arguments.fleet.empty()) {
    inputs.fleet = read_fleet(arguments.fleet);
    inputs.log_rules = read_log_rules(arguments.fleet);
    inputs.named_files.push_back(arguments.fleet);
  }
  inputs.words = arguments.flights;
  inputs.found = find_flights(arguments.flights, inputs.log_rules, inputs.map.empty());
  leave_out_copies(inputs.found);
  read_models(arguments.models, inputs);
  const std::map<std::string, std::string> flown = flown_models(inputs);
  for (const auto& [vehicle, use] : inputs.fleet) {
    if (inputs.kinds.index(use.kind) < 0)
      add_kind(inputs.kinds, use.kind, stability::read_model(use.model).mass_kg);
  }
  use_log_rules(inputs);
  if (inputs.models.empty()) use_other_models(arguments, flown, inputs);
  complete_models(arguments, inputs);
  for (const stability::Model& model : inputs.models) add_kind(inputs.kinds, model.kind, model.mass_kg);
  inputs.fallback_kind = inputs.models[0].kind;
  inputs.cache = std::make_shared<LogCache>(inputs.rules.per_mass);
  const bool is_of_fleet = std::any_of(flown.begin(), flown.end(), [&inputs](const auto& one) {
    return inputs.fleet.at(one.first).kind == inputs.fallback_kind;
  });
  if (inputs.models.size() == 1 && !flown.empty() && !is_of_fleet) {
    for (auto& [vehicle, use] : inputs.fleet) use.kind = inputs.fallback_kind;
  }
  return inputs;
}

const stability::Model* Inputs::model_of(const std::string& kind) const {
  for (const stability::Model& model : models) {
    if (model.kind == kind) return &model;
  }
  return nullptr;
}

stability::Model Inputs::model_for(const Track& track) const {
  const auto of_log = log_models.find(track.path);
  const auto own = vehicle_models.find(track.vehicle);
  stability::Model model = of_log != log_models.end()    ? of_log->second
                           : own != vehicle_models.end() ? own->second
                                                         : *model_of(track.kind);
  const auto mass = log_masses_kg.find(track.path);
  if (mass != log_masses_kg.end() && !rules.per_mass) model.mass_kg = mass->second;
  return model;
}

std::vector<Track> Inputs::load(std::size_t index, std::vector<std::string>& problems) const {
  // A vehicle whose kind has no model serves only as a neighbour.
  Fleet uses = fleet;
  for (auto& [vehicle, use] : uses) {
    if (model_of(use.kind) == nullptr) use.position_only = true;
  }
  const FlightFiles& flight = found.flights[index];
  const auto load_all = [&](std::vector<std::string>& told) {
    std::vector<Track> all = load_flight(flight, uses, fallback_kind, kinds, map, rules, *cache, told);
    for (Track& track : all)
      if (flight.part_s) track = part_of(track, *flight.part_s);
    return all;
  };
  std::vector<Track> loaded =
      tracks == nullptr ? load_all(problems) : tracks->tracks(flight, load_all, problems);
  for (Track& track : loaded) {
    if (track.position_only) continue;
    if (has_only_log_models && log_models.count(track.path) == 0) {
      problems.push_back(track.path + ": no model is named, and flights.toml gives none for this log");
      track.position_only = true;
      continue;
    }
    const bool has_own = log_models.count(track.path) != 0 || vehicle_models.count(track.vehicle) != 0;
    if (!has_own && model_of(track.kind) == nullptr) {
      track.position_only = true;
      continue;
    }
    const stability::Model model = model_for(track);
    if (track.thrust_source == logs::ThrustSource::kDuty && model.num_rotors() != 4 && !rules.per_mass) {
      problems.push_back(fmt::format("{}: the log has the duties of 4 motors, and {} has {} rotors",
                                     track.path, model.path, model.num_rotors()));
      track.position_only = true;
      continue;
    }
    apply_model(model, kinds, rules, track);
    cut_large_forces(model, rules, track);
    cut_impacts(model, rules, track);
    if (rules.per_mass) continue;
    for (logs::Doubt& doubt : doubts_of(model, track)) track.doubts.push_back(std::move(doubt));
  }
  return loaded;
}

std::vector<std::string> Inputs::files() const {
  std::vector<std::string> all = named_files;
  const std::vector<std::string> logs = log_files(found);
  all.insert(all.end(), logs.begin(), logs.end());
  return all;
}

}  // namespace swarmcert::residuals

/// @file Inputs of compare, diagnose and add: models, flights and vehicles.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "analysis/logs/signals.h"
#include "analysis/residuals/log_cache.h"
#include "analysis/residuals/track.h"
#include "analysis/residuals/track_store.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// The files named by the user.
struct InputArguments {
  std::vector<std::string> models;   ///< model.toml files, at most one per kind; may be empty
  std::vector<std::string> flights;  ///< files and folders
  std::string fleet;                 ///< flights.toml
  std::string columns;               ///< columns.toml; if empty, columns are recognised by name
  std::string network;               ///< learned force that replaces each model's own; empty: none
  CutRules rules;
  /// Allows a missing model if neither a known vehicle nor a log provides one: sets CutRules::per_mass and uses a model
  /// of 1 kg, so that newtons are m/s^2.
  bool may_lack_model = false;
};

/// All inputs except the data of the flights. A vehicle uses the given model of its kind or, without given models, its
/// model from the fleet. Vehicles missing from the fleet, and all vehicles if none has the kind of the only model, use
/// that model.
struct Inputs {
  std::vector<stability::Model> models;  ///< one per kind
  /// If the fleet assigns several models to vehicles of one kind: those that differ from the kind's, by vehicle.
  std::map<std::string, stability::Model> vehicle_models;
  Kinds kinds;
  Fleet fleet;
  std::vector<std::string> words;  ///< files and folders of flights, as the user named them
  FoundFlights found;
  LogRules log_rules;
  /// Properties that `[log]` rules give to single logs, by path: model, mass, gains.
  std::map<std::string, stability::Model> log_models;
  bool has_only_log_models = false;  ///< no other model is known: a log without one is only a neighbour
  std::map<std::string, double> log_masses_kg;
  std::map<std::string, stability::Gains> log_gains;
  logs::SignalMap map;
  CutRules rules;

  const stability::Model* model_of(const std::string& kind) const;  ///< nullptr: only a neighbour
  /// Returns the log's own model, else the vehicle's, else that of its kind, with the log's own mass if it has one.
  /// Precondition: the track is not position only.
  stability::Model model_for(const Track& track) const;
  /// Loads flight `index` and applies the models; tracks without a model become position only.
  std::vector<Track> load(std::size_t index, std::vector<std::string>& problems) const;
  /// Returns the paths of model.toml, flights.toml and logs, for the list of inputs in a result.
  std::vector<std::string> files() const;

  std::string fallback_kind;
  std::vector<std::string> named_files;
  std::shared_ptr<LogCache> cache;  ///< shared by copies
  /// Source of the tracks for load(); if null, tracks are read from the logs. Copies that share a store may differ only
  /// in the models of the same kinds and in the selection of flights.
  std::shared_ptr<TrackStore> tracks;
};

/// Reads the inputs.
/// @throws files::InputError as the readers of these files do, and if two models have the same kind.
Inputs read_inputs(const InputArguments& arguments);

/// Makes `network`, a file, the only learned force of `model`.
void set_network(stability::Model& model, const std::string& network);

}  // namespace swarmcert::residuals

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

/// Which files the user named.
struct InputArguments {
  std::vector<std::string> models;   ///< model.toml files, at most one per kind; may be empty
  std::vector<std::string> flights;  ///< files and folders
  std::string fleet;                 ///< flights.toml
  std::string columns;               ///< columns.toml; empty: the known columns
  std::string network;  ///< a learned force that every model gets, in place of its own; empty: none
  CutRules rules;
  /// Without a model, a known vehicle and a log's own model: CutRules::per_mass and a model of 1 kg, so that newtons
  /// are m/s^2.
  bool may_lack_model = false;
};

/// Everything but the flights' data. Vehicles fly the given model of their kind; without models, the fleet's; a
/// vehicle that the fleet does not name, and every vehicle where none has the kind of the only model, that model.
struct Inputs {
  std::vector<stability::Model> models;  ///< one per kind
  /// Where the fleet gives vehicles of one kind several models, those that differ from the kind's, by vehicle.
  std::map<std::string, stability::Model> vehicle_models;
  Kinds kinds;
  Fleet fleet;
  std::vector<std::string> words;  ///< files and folders of flights, as the user named them
  FoundFlights found;
  LogRules log_rules;
  /// What `[log]` rules give single logs, by path: a model, a mass, gains.
  std::map<std::string, stability::Model> log_models;
  bool has_only_log_models =
      false;  ///< no other model is known: a log without one is a neighbour and nothing else
  std::map<std::string, double> log_masses_kg;
  std::map<std::string, stability::Gains> log_gains;
  logs::SignalMap map;
  CutRules rules;

  const stability::Model* model_of(const std::string& kind) const;  ///< nullptr: only a neighbour
  /// The log's own model, else the vehicle's, else that of its kind; with the log's own mass where it has one.
  /// Precondition: the track is not position only.
  stability::Model model_for(const Track& track) const;
  /// Loads flight `index`; tracks without a model are position only; applies the models.
  std::vector<Track> load(std::size_t index, std::vector<std::string>& problems) const;
  /// model.toml, flights.toml and logs, for the list of inputs of a result.
  std::vector<std::string> files() const;

  std::string fallback_kind;
  std::vector<std::string> named_files;
  std::shared_ptr<LogCache> cache;  ///< shared by copies
  /// Where load() takes tracks from; null: from the logs. Copies that share it may differ in models of the same kinds
  /// and in the choice of flights, in nothing else.
  std::shared_ptr<TrackStore> tracks;
};

/// @throws files::InputError as the readers of these files do, and where two models have one kind.
Inputs read_inputs(const InputArguments& arguments);

}  // namespace swarmcert::residuals

/// @file Drafts a model of an unknown vehicle from its logs alone.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// A parameter of a drafted model.
struct DraftedParameter {
  std::string name;
  double value = 0;
  bool has_interval = false;
  /// 90 % interval, from the scatter between flights, or between blocks of 2 s of one flight.
  double lower = 0, upper = 0;
  std::string source;  ///< log parameter, fit, or assumption, in words
};

struct ModelDraft {
  stability::Model model;
  std::vector<DraftedParameter> parameters;
  std::vector<std::string> problems;  ///< logs that could not be used, and why
  std::size_t flights = 0;            ///< number of logs used in the fits
};

/// Drafts a model.
/// @param found    the flights
/// @param masses_kg  by path, from flights.toml; empty if unknown
/// @param mass_kg  of the vehicle; 0: unknown. Then the mass is the one carried by the thrust according to the thrust
///   map or the controller's own scale; without either, 1 kg.
/// @param keep  use damaged and implausible logs as well
/// @param base  provides the thrust map of duties and everything that logs do not show, scaled to the mass
/// @throws files::InputError if no log has a force and a flight.
ModelDraft draft_model(const residuals::FoundFlights& found, const logs::SignalMap& map,
                       const std::map<std::string, double>& masses_kg, double mass_kg, bool keep,
                       const stability::Model& base);

}  // namespace swarmcert::identification

/// @file The best model that logs support before anything is known of the vehicle.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// One number of a drafted model.
struct DraftedParameter {
  std::string name;
  double value = 0;
  bool has_interval = false;
  double lower = 0,
         upper = 0;    ///< 90 %, from the scatter between flights, or between blocks of 2 s of one flight
  std::string source;  ///< log parameter, fit, or assumption, in words
};

struct ModelDraft {
  stability::Model model;
  std::vector<DraftedParameter> parameters;
  std::vector<std::string> problems;  ///< logs that could not be used, and why
  std::size_t flights = 0;            ///< logs that the fits used
};

/// @param found    the flights.
/// @param masses_kg  by path, from flights.toml; empty where none is known.
/// @param mass_kg  of the vehicle; 0: not known. Then the mass is what the thrust carries if the thrust map, or the
///   controller's own scale, is right; without either, 1 kg.
/// @param keep  damaged and implausible logs are used all the same.
/// @param base  gives the thrust map of duties and what no log says, scaled to the mass.
/// @throws files::InputError if no log has a force and a flight.
ModelDraft draft_model(const residuals::FoundFlights& found, const logs::SignalMap& map,
                       const std::map<std::string, double>& masses_kg, double mass_kg, bool keep,
                       const stability::Model& base);

}  // namespace swarmcert::identification

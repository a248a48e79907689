/// @file What compare, diagnose and add have in common on the command line.
#pragma once

#include <string>
#include <vector>

#include "analysis/cli/command.h"
#include "analysis/residuals/inputs.h"
#include "analysis/residuals/statistics.h"

namespace swarmcert::analysis {

struct FlightOptions {
  std::vector<std::string> words;   ///< model.toml files, then flights
  std::vector<std::string> models;  ///< --model
  std::string fleet, columns, network;
  bool published_filter = false, published_signals = false;
  bool keep = false;  ///< --keep
};

/// Declares --flights, --columns and, where `positional_models`, MODEL... FLIGHTS..., else --model and FLIGHTS...
void declare_flights(CLI::App& app, FlightOptions& options, bool positional_models);

/// Reads models and the list of flights; the bundled flights.toml where --flights is not given.
/// @param own_models  vehicles of one kind may have models of their own (flights.toml).
/// @throws files::InputError as residuals::read_inputs(), and where they have but may not.
/// @param fits  the flights are fitted: damaged logs are left out unless --keep is given.
/// @param may_lack_model  as residuals::InputArguments::may_lack_model.
residuals::Inputs read_flights(const FlightOptions& options, bool own_models = false,
                               bool may_lack_model = false, bool fits = false);

files::Json json_of(const residuals::Axes& axes);

}  // namespace swarmcert::analysis

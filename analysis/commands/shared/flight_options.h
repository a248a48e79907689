/// @file What compare, diagnose and add have in common on the command line.
#pragma once

#include <string>
#include <vector>

#include "analysis/cli/command.h"
#include "analysis/residuals/force_unit.h"
#include "analysis/residuals/inputs.h"
#include "analysis/residuals/statistics.h"

namespace swarmcert::analysis {

struct FlightOptions {
  std::vector<std::string> words;   ///< model.toml files, then flights
  std::vector<std::string> models;  ///< --model
  std::string fleet, columns, network;
  bool published_filter = false, published_signals = false;
  bool keep = false;  ///< --keep
  std::string unit;   ///< --unit of declare_unit()
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

/// Declares --unit, the one unit of forces on a page.
/// @param standard "N", "gf", "m_s2", or empty: gf for vehicles below 1 N, else N
void declare_unit(CLI::App& app, FlightOptions& options, const std::string& standard = "N");

/// The unit that --unit asks for; m/s^2 where no mass is known.
/// @throws UsageError where the flights have no such unit: forces without a mass, one mass for several kinds.
residuals::ForceUnit page_unit(const FlightOptions& options, const residuals::Inputs& inputs);

/// The same models and other flights: those of --against.
/// @throws UsageError where a flight stands on both sides: it would be held against itself.
residuals::Inputs read_others(const FlightOptions& options, const std::vector<std::string>& against,
                              const residuals::Inputs& inputs);

/// `files` and, behind them, what `others` read besides, which is also returned.
std::vector<std::string> add_files_of(const residuals::Inputs& others, std::vector<std::string>& files);

files::Json json_of(const residuals::Axes& axes);

}  // namespace swarmcert::analysis

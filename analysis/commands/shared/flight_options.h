/// @file Command line options shared by compare, diagnose and add.
#pragma once

#include <string>
#include <vector>

#include "analysis/cli/command.h"
#include "analysis/residuals/force_unit.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::analysis {

struct FlightOptions {
  std::vector<std::string> words;   ///< model.toml files, then flights
  std::vector<std::string> models;  ///< --model
  std::string fleet, columns, network;
  bool published_filter = false, published_signals = false;
  bool keep = false;      ///< --keep
  std::string unit;       ///< --unit, see declare_unit()
  bool no_embed = false;  ///< --no-embed
};

/// Declares --flights, --columns and either MODEL... FLIGHTS... (if `positional_models`) or --model and FLIGHTS...
void declare_flights(CLI::App& app, FlightOptions& options, bool positional_models);

/// Reads the models and the list of flights; the bundled flights.toml if --flights is not given.
/// @param own_models vehicles of one kind may have individual models (flights.toml).
/// @param fits the flights are fitted: damaged logs are left out unless --keep is given.
/// @param may_lack_model as residuals::InputArguments::may_lack_model.
/// @throws files::InputError as residuals::read_inputs(), and for individual models if `own_models` is false.
residuals::Inputs read_flights(const FlightOptions& options, bool own_models = false,
                               bool may_lack_model = false, bool fits = false);

/// Declares --unit, the unit of all forces in text and on a page.
void declare_unit(CLI::App& app, FlightOptions& options);

/// Declares --no-embed of commands that write a page.
void declare_no_embed(CLI::App& app, FlightOptions& options);

/// Returns the unit requested by --unit; m/s^2 if no mass is known. The default is N or mN, and with --published-filter
/// gf, in which the published tables are.
/// @throws UsageError if the flights do not support the unit: forces without a mass, or one mass for several kinds.
residuals::ForceUnit unit_of(const FlightOptions& options, const residuals::Inputs& inputs);

/// Reads the flights of --against with the same models.
/// @throws UsageError if a flight is on both sides, since it would be compared with itself.
residuals::Inputs read_others(const FlightOptions& options, const std::vector<std::string>& against,
                              const residuals::Inputs& inputs);

/// Appends to `files` the additional files read by `others`, and returns them.
std::vector<std::string> add_files_of(const residuals::Inputs& others, std::vector<std::string>& files);

/// Returns the command to type next, for a shell: "swarmcert COMMAND", `words`, the flights and the options with which
/// they were read, `more`.
std::string next_command(const std::string& command, std::vector<std::string> words,
                         const FlightOptions& options, const residuals::Inputs& inputs,
                         const std::vector<std::string>& more);

}  // namespace swarmcert::analysis

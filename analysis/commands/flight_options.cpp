#include "analysis/commands/flight_options.h"

#include <filesystem>

namespace swarmcert::analysis {

std::string bundled_folder(const std::string& name, const std::string& source) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path tool = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = tool.parent_path().parent_path() / "share/swarmcert" / name;
  if (!error && fs::exists(installed)) return installed.string();
  return (fs::path(SWARMCERT_SOURCE_DIR) / source).string();
}

void declare_flights(CLI::App& app, FlightOptions& options, bool positional_models) {
  if (positional_models) {
    app.add_option(
           "MODEL... FLIGHTS...", options.words,
           "model.toml files, one per kind of vehicle (may be left out for known vehicles), then flight logs "
           "or folders of them")
        ->required();
  } else {
    app.add_option("FLIGHTS", options.words, "Flight logs or folders of them")->required();
    app.add_option("--model", options.models, "model.toml")
        ->required()
        ->allow_extra_args(false)
        ->check(CLI::ExistingFile);
  }
  app.add_option("--flights", options.fleet,
                 "flights.toml: vehicles with their models (default: the published ones)")
      ->check(CLI::ExistingFile);
  app.add_option("--columns", options.columns, "columns.toml: what the columns of CSV logs mean")
      ->check(CLI::ExistingFile);
}

residuals::Inputs read_flights(const FlightOptions& options) {
  residuals::InputArguments arguments;
  arguments.models = options.models;
  for (const std::string& word : options.words) {
    const bool is_model = std::filesystem::path(word).extension() == ".toml";
    (is_model ? arguments.models : arguments.flights).push_back(word);
  }
  if (arguments.flights.empty()) throw UsageError("no flights: name logs or folders of them");
  arguments.fleet = options.fleet.empty()
                        ? bundled_folder("analysis/flights", "analysis/flights") + "/flights.toml"
                        : options.fleet;
  arguments.columns = options.columns;
  arguments.rules.published = options.published_filter;
  return residuals::read_inputs(arguments);
}

files::Json json_of(const residuals::Axes& axes) {
  return {{"x", axes.x}, {"y", axes.y}, {"z", axes.z}, {"total", axes.total}};
}

}  // namespace swarmcert::analysis

#include "analysis/commands/shared/flight_options.h"

#include <algorithm>
#include <filesystem>

#include "analysis/cli/bundled.h"
#include "analysis/cli/host.h"
#include "analysis/report/report_text.h"
#include "analysis/residuals/log_copies.h"
#include "nn/base/input_error.h"

namespace swarmcert::analysis {

void declare_flights(CLI::App& app, FlightOptions& options, bool positional_models) {
  if (positional_models) {
    app.add_option(
           "MODEL... FLIGHTS...", options.words,
           "model.toml files, one per kind of vehicle (may be left out for known vehicles), then flight logs "
           "or folders of them")
        ->required();
  } else {
    app.add_option("FLIGHTS", options.words, "Flight logs or folders of them");
    app.add_option("--model", options.models, "model.toml")->allow_extra_args(false);
  }
  app.add_option("--flights", options.fleet,
                 "flights.toml: vehicles with their models (default: the published ones)");
  app.add_flag("--keep", options.keep,
               "Use damaged or implausible logs. By default these are reported and left out: implausible "
               "logs always, damaged logs if something is fitted");
  app.add_option("--columns", options.columns,
                 "columns.toml: meaning of the columns of CSV logs; per signal column, unit and frame, as in "
                 "position_x = { column = \"px\", unit = \"mm\" }: time, position_x .. z, velocity_x .. z, "
                 "specific_force_x .. z, attitude_x .. z and _w, duty_1 .. 4, battery; if there, rate_x .. "
                 "z, target_position_x .. z, target_velocity_x .. z");
}

residuals::Inputs read_flights(const FlightOptions& options, bool own_models, bool may_lack_model,
                               bool fits) {
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
  arguments.may_lack_model = may_lack_model;
  arguments.network = options.network;
  arguments.rules.fits = fits;
  arguments.rules.keep = options.keep;
  arguments.rules.published = options.published_filter;
  arguments.rules.published_signals = options.published_signals;
  arguments.rules.keep_impacts = options.published_filter || options.published_signals;
  residuals::Inputs inputs = residuals::read_inputs(arguments);
  for (const auto& [copy, first] : inputs.found.copies)
    note(copy + " is left out: it has the bytes of " + first);
  if (!own_models && !inputs.vehicle_models.empty()) {
    throw files::InputError({arguments.fleet, "",
                             "vehicle." + inputs.vehicle_models.begin()->first + ".model", "",
                             "is not the model of the other vehicles of its kind",
                             "this command works on one model per kind: name it on the command line"});
  }
  return inputs;
}

void declare_unit(CLI::App& app, FlightOptions& options) {
  app.add_option(
         "--unit", options.unit,
         "Unit of forces in text and pages: N (the default; mN below a weight of 10 N), gf, or m_s2 (over "
         "the mass)")
      ->check(CLI::IsMember({"N", "gf", "m_s2"}));
}

void declare_no_embed(CLI::App& app, FlightOptions& options) {
  app.add_flag("--no-embed", options.no_embed,
               "Leave the signals of the logs out of the page: no curves over time, nothing in space");
}

residuals::ForceUnit unit_of(const FlightOptions& options, const residuals::Inputs& inputs) {
  const bool is_acceleration = options.unit == "m_s2";
  if (inputs.rules.per_mass) {
    if (!options.unit.empty() && !is_acceleration)
      throw UsageError("--unit " + options.unit + ": no mass is known, so forces are in m/s^2; name a model");
    return {"m/s^2", 1};
  }
  if (is_acceleration && inputs.models.size() > 1)
    throw UsageError("--unit m_s2: the kinds of vehicles differ in mass; use N or gf, or a single kind");
  const bool is_published = options.unit.empty() && options.published_filter;
  return residuals::force_unit(is_published ? "gf" : options.unit, inputs.models);
}

residuals::Inputs read_others(const FlightOptions& options, const std::vector<std::string>& against,
                              const residuals::Inputs& inputs) {
  FlightOptions words = options;
  words.words.erase(std::remove_if(words.words.begin(), words.words.end(),
                                   [](const std::string& word) {
                                     return std::filesystem::path(word).extension() != ".toml";
                                   }),
                    words.words.end());
  words.words.insert(words.words.end(), against.begin(), against.end());
  residuals::Inputs others = read_flights(words, false, false, true);
  residuals::LogCopies copies;
  for (const std::string& file : log_files(inputs.found)) copies.add(file);
  for (const std::string& file : log_files(others.found)) {
    const std::string first = copies.add(file);
    if (!first.empty())
      throw UsageError("--against " + file + " is on both sides" +
                       (first == file ? "" : ": it has the bytes of " + first));
  }
  return others;
}

std::vector<std::string> add_files_of(const residuals::Inputs& others, std::vector<std::string>& files) {
  std::vector<std::string> added;
  for (const std::string& file : others.files()) {
    if (std::find(files.begin(), files.end(), file) != files.end()) continue;
    files.push_back(file);
    added.push_back(file);
  }
  return added;
}

std::string next_command(const std::string& command, std::vector<std::string> words,
                         const FlightOptions& options, const residuals::Inputs& inputs,
                         const std::vector<std::string>& more) {
  words.insert(words.begin(), {"swarmcert", command});
  words.insert(words.end(), inputs.words.begin(), inputs.words.end());
  if (!options.fleet.empty()) words.insert(words.end(), {"--flights", options.fleet});
  if (!options.columns.empty()) words.insert(words.end(), {"--columns", options.columns});
  if (options.keep) words.emplace_back("--keep");
  if (!options.unit.empty()) words.insert(words.end(), {"--unit", options.unit});
  words.insert(words.end(), more.begin(), more.end());
  return shell_line(words);
}

}  // namespace swarmcert::analysis

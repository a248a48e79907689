#include <fmt/core.h>

#include <memory>

#include "analysis/cli/bundled.h"
#include "analysis/cli/command_line.h"
#include "analysis/cli/counted.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/shared/plausibility_output.h"
#include "analysis/identification/model_draft.h"
#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

struct ModelOptions {
  std::vector<std::string> words;  ///< "draft", then flights
  std::string fleet, columns, base, output;
  double mass_kg = 0;
  bool keep = false;
};

int run_model(const ModelOptions& options, const CommonOptions& common) {
  if (options.words.empty() || options.words[0] != "draft")
    throw UsageError("'model' knows one action: model draft FLIGHTS -o model.toml");
  if (options.words.size() < 2) throw UsageError("no flights: name logs or folders of them");
  if (options.mass_kg < 0) throw UsageError("--mass must be positive");
  refuse_to_replace(common, common.json);
  refuse_to_replace(common, options.output);
  residuals::LogRules rules;
  if (!options.fleet.empty()) rules = residuals::read_log_rules(options.fleet);
  const residuals::FoundFlights found = residuals::find_flights(
      {options.words.begin() + 1, options.words.end()}, rules, options.columns.empty());
  std::map<std::string, double> masses_kg;
  std::vector<std::string> inputs = residuals::log_files(found);
  for (const residuals::FlightFiles& flight : found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      const residuals::LogRule rule = residuals::rule_for(rules, path);
      if (rule.mass_kg > 0) masses_kg[path] = rule.mass_kg;
    }
  }
  const std::string base = options.base.empty()
                               ? bundled_folder("models", "stability/models") + "/crazyflie-small.toml"
                               : options.base;
  inputs.push_back(base);
  const logs::SignalMap map =
      options.columns.empty() ? logs::known_columns() : logs::read_columns(options.columns);
  const identification::ModelDraft draft = identification::draft_model(
      found, map, masses_kg, options.mass_kg, options.keep, stability::read_model(base));
  std::vector<std::string> comments = {"Drafted from " + counted(draft.flights, "log") + "."};
  files::Json result = result_head("model", inputs);
  result["flights"] = draft.flights;
  result["parameters"] = files::Json::array();
  for (const identification::DraftedParameter& p : draft.parameters) {
    comments.push_back(fmt::format("{} = {:.6g}: {}", p.name, p.value, p.source));
    result["parameters"].push_back(
        {{"name", p.name},
         {"value", p.value},
         {"interval", p.has_interval ? files::Json({p.lower, p.upper}) : files::Json(nullptr)},
         {"source", p.source}});
    if (common.prints_text())
      fmt::print("{:<22}{:>12.6g}{}  {}\n", p.name, p.value,
                 p.has_interval ? fmt::format(" [{:.6g}, {:.6g}]", p.lower, p.upper) : "", p.source);
  }
  result["problems"] = draft.problems;
  if (common.prints_text()) {
    for (const std::string& problem : few_of_each(draft.problems)) fmt::print("not used: {}\n", problem);
  }
  files::write_file(options.output, stability::to_toml(draft.model, comments), common.force);
  write_result(common, result);
  return kDone;
}

}  // namespace

Command model_command() {
  return {"model", "Draft a model.toml from flight logs",
          "Each number has its source: the log, a fit with a 90 % interval, or an assumption.\n\n"
          "Example: swarmcert model draft flights/ -o model.toml\n"
          "         swarmcert model draft flights/ --mass 0.0375 -o model.toml",
          [](CLI::App& app) {
            const auto options = std::make_shared<ModelOptions>();
            app.add_option("draft FLIGHTS...", options->words, "draft, then flight logs or folders of them")
                ->required();
            app.add_option("--mass", options->mass_kg, "Mass of the vehicle in kg, if known");
            app.add_option("--base", options->base,
                           "model.toml whose thrust map and shape are assumed (default: crazyflie-small)");
            app.add_option("--flights", options->fleet, "flights.toml: masses of single logs");
            app.add_flag("--keep", options->keep, "Use damaged and implausible logs as well");
            app.add_option("--columns", options->columns, "columns.toml: meaning of the columns of CSV logs");
            add_output(app, "-o,--output", options->output, "The new model.toml")->required();
            return [options](const CommonOptions& common) { return run_model(*options, common); };
          }};
}

}  // namespace swarmcert::analysis

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

void describe_parameter(files::Record& record, const identification::DraftedParameter& p) {
  record.field("name", p.name, "Key of the parameter in model.toml, with its unit.");
  record.field("value", p.value, "In the unit of the name.");
  record.field("interval",
               p.has_interval ? std::optional<std::array<double, 2>>({p.lower, p.upper}) : std::nullopt,
               "From the scatter between flights or blocks; null: not fitted.", "", "90 % interval");
  record.field("source", p.source, "The log, a fit, or an assumption.");
}

struct ModelResult {
  identification::ModelDraft draft;
};

void describe(files::Record& record, const ModelResult& result) {
  record.field("flights", result.draft.flights, "Number of logs that were used.");
  record.list("parameters", result.draft.parameters, "Every number of the model.", describe_parameter);
  record.field("problems", result.draft.problems, "Logs that were not used, and why.");
}

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
      options.columns.empty() ? logs::SignalMap() : logs::read_columns(options.columns);
  const ModelResult result = {identification::draft_model(found, map, masses_kg, options.mass_kg,
                                                          options.keep, stability::read_model(base))};
  const identification::ModelDraft& draft = result.draft;
  std::vector<std::string> comments = {"Drafted from " + counted(draft.flights, "log") + "."};
  for (const identification::DraftedParameter& p : draft.parameters) {
    comments.push_back(fmt::format("{} = {:.6g}: {}", p.name, p.value, p.source));
    if (common.prints_text())
      fmt::print("{:<22}{:>12.6g}{}  {}\n", p.name, p.value,
                 p.has_interval ? fmt::format(" [{:.6g}, {:.6g}]", p.lower, p.upper) : "", p.source);
  }
  if (common.prints_text()) {
    for (const std::string& problem : few_of_each(draft.problems)) fmt::print("not used: {}\n", problem);
  }
  files::write_file(options.output, stability::to_toml(draft.model, comments), common.force);
  write_result(common, result_of("model", inputs, std::nullopt, result));
  std::vector<std::string> next = {"study", options.output};
  next.insert(next.end(), options.words.begin() + 1, options.words.end());
  next.insert(next.end(), {"-o", "study"});
  print_next(common, next);
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
          },
          fields_of<ModelResult>()};
}

}  // namespace swarmcert::analysis

#include <fmt/core.h>

#include <memory>
#include <sstream>

#include "analysis/commands/flight_options.h"
#include "analysis/identification/ladder.h"
#include "analysis/progress.h"
#include "nn/files/file_io.h"
#include "nn/files/suggest.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using identification::Ladder;

struct Options {
  FlightOptions flights;
  std::string effects, output;
  bool keep_anyway = false;
};

std::vector<std::string> split_names(const std::string& text) {
  std::vector<std::string> names;
  std::istringstream words(text);
  for (std::string name; std::getline(words, name, ',');) {
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

void check(const std::vector<std::string>& names, const stability::Model& model) {
  const std::vector<std::string> known = stability::effect_names();
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw UsageError("unknown effect " + name + ": " + files::did_you_mean(name, known));
    if (name == "deep_set" || name == "torque_bias")
      throw UsageError("the effect " + name +
                       " cannot be fitted to the force of a flight; write it into the model file");
    if (identification::is_taken(name, model))
      throw UsageError("the model has the effect " + name +
                       " already; remove it from the file to fit it anew");
  }
}

files::Json names_of(const residuals::Inputs& inputs, const std::vector<int>& which) {
  files::Json names = files::Json::array();
  for (const int i : which) names.push_back(inputs.found.flights[static_cast<std::size_t>(i)].name);
  return names;
}

files::Json result_of(const Ladder& ladder, const residuals::Inputs& inputs) {
  files::Json json = result_head("add", inputs.files());
  json["ladder"] = files::Json::array();
  for (const identification::Step& step : ladder.steps) {
    json["ladder"].push_back({{"effect", step.effect},
                              {"fit_rmse", step.fit_rmse_N},
                              {"select_rmse", step.select_rmse_N},
                              {"test_rmse", step.test_rmse_N},
                              {"accepted", step.accepted},
                              {"reason", step.reason}});
  }
  json["split"] = {{"by_flight", ladder.split.by_flight},
                   {"fit", names_of(inputs, ladder.split.fit)},
                   {"select", names_of(inputs, ladder.split.select)},
                   {"test", names_of(inputs, ladder.split.test)}};
  json["effects"] = files::Json::array();
  for (const stability::EffectSpec& effect : ladder.model.effects) {
    files::Json entry = {{"effect", effect.name}, {"parameters", effect.parameters}};
    for (const auto& [name, interval] : effect.fit.interval)
      entry["interval_90"][name] = {interval.first, interval.second};
    json["effects"].push_back(std::move(entry));
  }
  return json;
}

void print(const Ladder& ladder) {
  fmt::print("RMSE of the force residual, in newton; flights for fit / select / test: {} / {} / {}{}\n",
             ladder.split.fit.size(), ladder.split.select.size(), ladder.split.test.size(),
             ladder.split.by_flight ? "" : " (too few to split: all for everything)");
  fmt::print("  {:<18}{:>10}{:>10}{:>10}\n", "", "fit", "select", "test");
  for (const identification::Step& step : ladder.steps) {
    fmt::print("  {:<18}{:>10.5f}{:>10.5f}{:>10.5f}{}\n",
               (step.effect == "nominal" ? "" : "+ ") + step.effect, step.fit_rmse_N, step.select_rmse_N,
               step.test_rmse_N,
               step.reason.empty() ? "" : (step.accepted ? "  kept although " : "  refused: ") + step.reason);
  }
  for (const stability::EffectSpec& effect : ladder.model.effects) {
    for (const auto& [name, value] : effect.parameters) {
      const auto interval = effect.fit.interval.find(name);
      fmt::print("{} {} = {:.4g}", effect.name, name, value);
      if (interval != effect.fit.interval.end())
        fmt::print(", 90 % {:.4g} .. {:.4g}", interval->second.first, interval->second.second);
      fmt::print("\n");
    }
  }
}

int run(const Options& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_to_replace(common, options.output);
  if (options.flights.models.size() != 1) throw UsageError("add takes one --model");
  const residuals::Inputs inputs = read_flights(options.flights);
  identification::LadderOptions what;
  what.automatic = options.effects == "auto";
  if (!what.automatic) what.effects = split_names(options.effects);
  what.keep_anyway = options.keep_anyway;
  check(what.effects, inputs.models[0]);
  Progress progress(common.quiet);
  const Ladder ladder = identification::climb(
      inputs, what, common.jobs, [&](int done, int total) { progress.show(done, total, "flights"); });
  const bool any = std::any_of(ladder.steps.begin() + 1, ladder.steps.end(),
                               [](const identification::Step& step) { return step.accepted; });
  if (any) {
    files::write_file(options.output,
                      stability::to_toml(ladder.model, {"Effects fitted to flights by swarmcert add."}),
                      common.force);
  }
  write_result(common, result_of(ladder, inputs));
  if (common.prints_text()) {
    print(ladder);
    if (any)
      fmt::print("Written: {}\n", options.output);
    else
      fmt::print("Nothing helped: {} is not written. --keep-anyway writes it all the same.\n",
                 options.output);
  }
  // Measured residuals are never exactly zero: there was none.
  const bool has_records = ladder.steps.front().fit_rmse_N > 0;
  if (!has_records)
    fmt::print(stderr, "no usable record: nothing was fitted; 'swarmcert compare' says what was cut\n");
  return has_records ? kDone : kInconclusive;
}

}  // namespace

Command add_command() {
  return {"add", "Fit effects to flights and add them to a model, with the errors before and after",
          "EFFECT is one name, several with commas, or auto: what diagnose finds on the flights of the fit. "
          "An effect\n"
          "is accepted if the error of flights that the fit has not seen falls; the test flights are only "
          "shown.\n\n"
          "Example: swarmcert add auto --model stability/models/crazyflie-small.toml flights/ -o fitted.toml",
          [](CLI::App& app) {
            const auto options = std::make_shared<Options>();
            app.add_option("EFFECT", options->effects, "Names of effects with commas between, or auto")
                ->required();
            declare_flights(app, options->flights, false);
            app.add_option("-o,--output", options->output, "The new model.toml")->required();
            app.add_flag("--keep-anyway", options->keep_anyway, "Add also what does not help");
            return [options](const CommonOptions& common) { return run(*options, common); };
          }};
}

}  // namespace swarmcert::analysis

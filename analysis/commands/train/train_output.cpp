#include "analysis/commands/train/train_output.h"

#include <fmt/core.h>

#include <cmath>

#include "analysis/cli/command.h"
#include "analysis/cli/counted.h"
#include "analysis/commands/shared/plausibility_output.h"
#include "nn/base/json_number.h"

namespace swarmcert::analysis {

using learning::LearningData;
using learning::Use;

namespace {

/// Whether the network is worse than none by more than the summation order of float32 products can explain.
bool worse_than_none(const learning::SupportedErrors& errors) {
  return errors.network > errors.nothing * (1 + 1e-6);
}

void add_selection(const Outcome& outcome, double SI, files::Json& json) {
  json["kept"] = outcome.kept();
  json["output_scales"] = outcome.support.scales;
  json["silent"] = files::Json::array();
  for (const auto& [composition, errors] : outcome.support.silent)
    json["silent"].push_back(
        {{"vehicles", composition}, {"rmse", errors.network * SI}, {"rmse_of_nothing", errors.nothing * SI}});
  const learning::SupportedErrors all = outcome.support.all();
  json["select_rmse"] = files::finite(all.network * SI);
  json["select_rmse_of_nothing"] = files::finite(all.nothing * SI);
  json["select"] = files::Json::array();
  for (const auto& [composition, scores] : outcome.support.left) {
    json["select"].push_back({{"vehicles", composition},
                              {"rmse", scores.network * SI},
                              {"rmse_of_nothing", scores.nothing * SI},
                              {"worse_than_none", worse_than_none(scores)}});
  }
}

void add_runs(const Outcome& outcome, const std::string& unit, files::Json& json) {
  const learning::TaughtRun& trained = outcome.trained;
  json["teachers"] = json["folds"] = files::Json::array();
  const auto json_of = [&unit](const learning::Score& score) {
    return files::Json{{"seed", score.seed},
                       {"best_epoch", score.best_epoch + 1},
                       {fmt::format("select_rmse_{}", unit), score.select_rmse}};
  };
  for (std::size_t i = 0; i + 1 < trained.scores.size(); ++i)
    json["teachers"].push_back(json_of(trained.scores[i]));
  json["taught"] = trained.scores.size() > 1 ? json_of(trained.scores.back()) : files::Json();
  for (const learning::Score& member : outcome.members) json["folds"].push_back(json_of(member));
  json["kept_seed"] = trained.run.seed;
  json["best_epoch"] = trained.run.best_epoch + 1;
  json["epochs"] = files::Json::array();
  for (const learning::Epoch& epoch : trained.run.epochs)
    json["epochs"].push_back({{fmt::format("fit_rmse_{}", unit), epoch.fit_rmse},
                              {fmt::format("select_rmse_{}", unit), epoch.select_rmse}});
}

}  // namespace

files::Json train_json(const TrainOptions& options, const std::vector<std::string>& inputs,
                       const LearningData& data, const Outcome& outcome) {
  files::Json json = result_head("train", inputs);
  json["seed"] = options.run.trainer.seed;
  json["gamma"] = options.run.trainer.gamma.value;
  json["max_lipschitz"] =
      options.run.max_lipschitz > 0 ? files::Json(options.run.max_lipschitz) : files::Json();
  json["layers"] = options.layers;
  json["samples"] = {{"fit", data.indices(Use::kFit).size()},
                     {"select", data.indices(Use::kSelect).size()},
                     {"test", data.indices(Use::kTest).size()}};
  const learning::TargetInfo& target = learning::info(data.target);
  const double SI = target.SI_per_unit;
  json["quantity"] = target.quantity;
  json["split"] = data.split_by_blocks ? "blocks" : "flights";
  json["test_rmse"] = files::finite(outcome.all.network * SI);
  json["test_rmse_" + std::string(target.unit)] = files::finite(outcome.all.network);
  json["test_rmse_of_nothing"] = files::finite(outcome.all.nothing * SI);
  for (std::size_t c = 0; c < outcome.components.size(); ++c) {
    const std::string axis(1, "xyz"[c]);
    json["test_rmse_axes"][axis] = files::finite(outcome.components[c].network * SI);
    json["test_rmse_of_nothing_axes"][axis] = files::finite(outcome.components[c].nothing * SI);
  }
  json["test"] = files::Json::array();
  for (const auto& [composition, scores] : outcome.compositions) {
    json["test"].push_back(
        {{"vehicles", composition}, {"rmse", scores.network * SI}, {"rmse_of_nothing", scores.nothing * SI}});
  }
  add_selection(outcome, SI, json);
  json["bounds"] = files::Json::array();
  for (const auto& [function, upper] : outcome.certified.set_bounds)
    json["bounds"].push_back({{"function", function},
                              {"upper", upper},
                              {"unit", fmt::format("{} per unit of input", target.unit)}});
  json["lipschitz"] = outcome.certified.largest();
  json["gamma_verdict"] = name(outcome.certified.gamma);
  add_runs(outcome, target.unit, json);
  json["problems"] = data.problems;
  return json;
}

namespace {

/// Prints which part of the output is kept, and why not all of it.
void print_support(const Outcome& outcome, const std::string& unit) {
  for (const auto& [kind, scale] : outcome.support.scales) {
    if (scale == 0) {
      fmt::print(
          "no network for {}: none of the compositions of the selecting flights is better off with it\n",
          kind);
    } else if (scale < 1) {
      fmt::print("output for {} scaled by {:.3f}, which suits the selecting flights best\n", kind, scale);
    }
  }
  for (const auto& [composition, errors] : outcome.support.silent)
    fmt::print(
        "no network for {}: {:.3f} {} on the selecting flights with the output as trained, {:.3f} without\n",
        composition, errors.network, unit, errors.nothing);
}

/// Prints the compositions in which the selecting flights are better off without the network.
void print_worse_than_none(const Outcome& outcome, const std::string& unit) {
  if (!outcome.kept()) {
    fmt::print(
        "no network is kept: on the selecting flights the error is {:.3f} {} with it and {:.3f} without; the "
        "written models do not use it\n",
        outcome.support.all().network, unit, outcome.support.all().nothing);
  }
  for (const auto& [composition, scores] : outcome.support.left) {
    if (!worse_than_none(scores)) continue;
    fmt::print("warning: worse than none for {}: {:.3f} {} on the selecting flights, {:.3f} without\n",
               composition, scores.network, unit, scores.nothing);
  }
}

}  // namespace

void print_training(const TrainOptions& options, const LearningData& data, const Outcome& outcome) {
  std::map<std::string, int> flights[3];
  for (const learning::TrackSamples& track : data.tracks)
    ++flights[static_cast<int>(track.use)][track.flight];
  fmt::print("{} samples: {} to fit ({}), {} to select ({}), {} to test ({})\n", data.samples.samples(),
             data.indices(Use::kFit).size(), counted(flights[0].size(), "flight"),
             data.indices(Use::kSelect).size(), flights[1].size(), data.indices(Use::kTest).size(),
             flights[2].size());
  if (data.split_by_blocks)
    fmt::print("blocks of the flights that are fitted select or test: these errors look too good\n");
  const learning::TargetInfo& target = learning::info(data.target);
  const learning::TaughtRun& trained = outcome.trained;
  for (std::size_t i = 0; i < trained.scores.size() && trained.scores.size() > 1; ++i) {
    const learning::Score& score = trained.scores[i];
    fmt::print("{} of seed {}: {:.3f} {} on the selecting flights{}\n",
               i + 1 < trained.scores.size() ? "teacher" : "taught", score.seed, score.select_rmse,
               target.unit, i == trained.kept ? ", kept" : "");
  }
  for (const learning::Score& member : outcome.members)
    fmt::print("seed {}: {:.3f} {} on the fold that it left out, best of its epochs: {}\n", member.seed,
               member.select_rmse, target.unit, member.best_epoch + 1);
  fmt::print("best of {} epochs: {}\n\n", trained.run.epochs.size(), trained.run.best_epoch + 1);
  fmt::print("{:<34}{:>18}{:>18}\n", fmt::format("{} on test flights", target.words),
             fmt::format("no network [{}]", target.unit), fmt::format("network [{}]", target.unit));
  for (const auto& [composition, scores] : outcome.compositions)
    fmt::print("{:<34}{:>18.3f}{:>18.3f}\n", composition, scores.nothing, scores.network);
  fmt::print("{:<34}{:>18.3f}{:>18.3f}\n", "all", outcome.all.nothing, outcome.all.network);
  for (std::size_t c = 0; c < outcome.components.size(); ++c) {
    fmt::print("{:<34}{:>18.3f}{:>18.3f}\n", fmt::format("all, along {}", "xyz"[c]),
               outcome.components[c].nothing, outcome.components[c].network);
  }
  fmt::print("\n");
  for (const auto& [function, upper] : outcome.certified.set_bounds)
    fmt::print("Lipschitz constant of {}: at most {:.8g} {} per unit of input, proved\n", function, upper,
               target.unit);
  fmt::print("gamma {} in every {}: {}\n", options.run.trainer.gamma.value, options.gamma_scope,
             name(outcome.certified.gamma));
  if (options.run.max_lipschitz > 0)
    fmt::print("Lipschitz constants at most {}: {}\n", options.run.max_lipschitz,
               outcome.certified.largest() <= options.run.max_lipschitz ? "proved" : "inconclusive");
  print_support(outcome, target.unit);
  for (const std::string& problem : few_of_each(data.problems)) fmt::print("note: {}\n", problem);
  print_worse_than_none(outcome, target.unit);
  fmt::print("written: {}/network.toml, weights, certificate.json, models\n", options.output);
}

}  // namespace swarmcert::analysis

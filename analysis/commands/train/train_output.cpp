#include "analysis/commands/train/train_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "analysis/cli/command.h"
#include "analysis/cli/counted.h"
#include "analysis/commands/shared/plausibility_output.h"

namespace swarmcert::analysis {

using learning::LearningData;
using learning::Use;

namespace {

/// Whether the network is worse than none by more than the summation order of float32 products can explain.
bool worse_than_none(const learning::SupportedErrors& errors) {
  return errors.network > errors.nothing * (1 + 1e-6);
}

/// Root mean square errors with a network and without, in SI units.
struct Errors {
  std::string composition;
  double network = 0, nothing = 0;
  bool worse_than_none = false;
};

template <class Scores>
std::vector<Errors> errors_of(const std::map<std::string, Scores>& scores, double SI) {
  std::vector<Errors> all;
  for (const auto& [composition, score] : scores)
    all.push_back({composition, score.network * SI, score.nothing * SI, false});
  return all;
}

void describe_test_errors(files::Record& record, const Errors& errors) {
  record.field("vehicles", errors.composition, "Neighbours > vehicle, by kind.");
  record.field("rmse", errors.network, "With the network, SI.");
  record.field("rmse_of_nothing", errors.nothing, "Without, SI.");
}

/// A number in the unit of the targets, which is part of the field's name.
void in_unit(files::Record& record, const std::string& stem, const std::string& unit, double value,
             const char* meaning) {
  for (const char* known : {"gf", "mN_m"})
    record.may((stem + known).c_str(), unit == known ? std::optional<double>(value) : std::nullopt, meaning);
}

void describe_axes(files::Record& record, const Outcome& outcome, double SI) {
  std::array<Scores, 3> scores{};
  std::copy_n(outcome.components.begin(), std::min<std::size_t>(3, outcome.components.size()),
              scores.begin());
  const auto axes = [&](double Scores::*part) -> std::optional<files::Axes> {
    if (outcome.components.empty()) return std::nullopt;
    return files::Axes{scores[0].*part * SI, scores[1].*part * SI, scores[2].*part * SI};
  };
  record.may("test_rmse_axes", axes(&Scores::network), "Error on test flights by axis, SI.");
  record.may("test_rmse_of_nothing_axes", axes(&Scores::nothing), "The same of predicting zero, SI.");
}

void describe_selection(files::Record& record, const Outcome& outcome, double SI) {
  record.field("kept", outcome.kept(),
               "Whether the network is better than none on the selecting flights; else it is not used.");
  record.field(
      "output_scales", outcome.support.scales,
      "Factor in [0, 1] of each kind's output, chosen on the selecting flights; 0: no network for this "
      "kind; empty with --allow-worse.");
  record.list(
      "silent", errors_of(outcome.support.silent, SI),
      "Compositions without a network, and the errors on the selecting flights with the output as trained "
      "and without.",
      describe_test_errors);
  const learning::SupportedErrors all = outcome.support.all();
  record.field("select_rmse", all.network * SI, "Error on the selecting flights, SI.");
  record.field("select_rmse_of_nothing", all.nothing * SI, "The same of predicting zero, SI.");
  std::vector<Errors> left = errors_of(outcome.support.left, SI);
  for (Errors& errors : left)
    errors.worse_than_none = worse_than_none(outcome.support.left.at(errors.composition));
  record.list(
      "select", left,
      "Errors on the selecting flights by composition, with what is kept of the output; with --folds, on "
      "all flights that do not test.",
      [](files::Record& one, const Errors& errors) {
        describe_test_errors(one, errors);
        one.field("worse_than_none", errors.worse_than_none, "By more than rounding can explain.");
      });
}

void describe_runs(files::Record& record, const Outcome& outcome, const std::string& unit) {
  const learning::TaughtRun& trained = outcome.trained;
  const auto describe_score = [&unit](files::Record& one, const learning::Score& score) {
    one.field("seed", score.seed, "Of the first weights and of the order of samples.");
    one.field("best_epoch", score.best_epoch + 1,
              "Epoch with the least error on the selecting flights, from 1.");
    in_unit(one, "select_rmse_", unit, score.select_rmse, "That error.");
  };
  const bool has_teachers = trained.scores.size() > 1;
  const std::vector<learning::Score> teachers(trained.scores.begin(),
                                              trained.scores.end() - (trained.scores.empty() ? 0 : 1));
  record.list("teachers", teachers, "The networks that were trained first.", describe_score);
  record.object_or_null(has_teachers, "taught", "The network that learned from the teachers; null: none.",
                        [&](files::Record& one) {
                          describe_score(one, has_teachers ? trained.scores.back() : learning::Score{});
                        });
  record.list(
      "folds", outcome.members,
      "With --folds: the networks whose mean was written, with their errors on the folds that they left out.",
      describe_score);
  record.field("kept_seed", trained.run.seed,
               "Seed of the network that was kept; with --folds, of the first whose mean was written.");
  record.field("best_epoch", trained.run.best_epoch + 1,
               "Epoch with the least error on the selecting flights, from 1.");
  record.list("epochs", trained.run.epochs, "With --folds, means over the networks.",
              [&unit](files::Record& one, const learning::Epoch& epoch) {
                in_unit(one, "fit_rmse_", unit, epoch.fit_rmse, "On the flights that are fitted.");
                in_unit(one, "select_rmse_", unit, epoch.select_rmse, "On the selecting flights.");
              });
}

struct ProvedBound {
  std::string function;
  double upper = 0;
};

void describe_bounds(files::Record& record, const Outcome& outcome, const std::string& unit) {
  std::vector<ProvedBound> bounds;
  for (const auto& [function, upper] : outcome.certified.set_bounds) bounds.push_back({function, upper});
  record.list("bounds", bounds, "Lipschitz constants of the network.",
              [&unit](files::Record& one, const ProvedBound& bound) {
                one.field("function", bound.function, "Of the network.");
                one.field("upper", bound.upper, "In `unit`.", "", "upper bound, proved");
                one.field("unit", unit + " per unit of input", "Of the bound.");
              });
  record.field("lipschitz", outcome.certified.largest(), "The largest of these.", "", "upper bound, proved");
  record.field("gamma_verdict", name(outcome.certified.gamma),
               "Whether every layer keeps gamma: proved, refuted or inconclusive.");
}

}  // namespace

void describe_training(files::Record& record, const TrainOptions& options, const LearningData& data,
                       const Outcome& outcome) {
  const learning::TargetInfo& target = learning::info(data.target);
  const double SI = target.SI_per_unit;
  record.field("gamma", options.run.trainer.gamma.value, "Largest spectral norm of a layer.");
  record.field(
      "max_lipschitz",
      options.run.max_lipschitz > 0 ? std::optional<double>(options.run.max_lipschitz) : std::nullopt,
      "Limit given by --max-lipschitz; null: none.");
  record.field("layers", options.layers, "Given by --layers: how weights keep their limits.");
  record.object("samples", "Number of samples of each use; with --folds, what does not test is fitted.",
                [&](files::Record& samples) {
                  samples.field("fit", data.indices(Use::kFit).size(), "Fitted.");
                  samples.field("select", data.indices(Use::kSelect).size(), "Select the epoch.");
                  samples.field("test", data.indices(Use::kTest).size(), "Used for nothing but the test.");
                });
  record.field("quantity", target.quantity, "What was learned: force_z, force or torque.");
  record.field("split", data.split_by_blocks ? "blocks" : "flights",
               "What was kept together when samples were split: flights or blocks.");
  record.field("test_rmse", outcome.all.network * SI, "On the test flights: N, or N m of a torque.");
  in_unit(record, "test_rmse_", target.unit, outcome.all.network, "The same in the unit of the network.");
  record.field("test_rmse_of_nothing", outcome.all.nothing * SI, "The same of predicting zero, SI.");
  describe_axes(record, outcome, SI);
  record.list("test", errors_of(outcome.compositions, SI), "Errors on test flights by composition.",
              describe_test_errors);
  describe_selection(record, outcome, SI);
  describe_bounds(record, outcome, target.unit);
  describe_runs(record, outcome, target.unit);
  record.field("problems", data.problems, "What could not be used, and why.");
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

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/train/train_report.h"
#include "analysis/learning/output_scale.h"
#include "analysis/learning/trained_network.h"
#include "analysis/learning/training_run.h"
#include "nn/base/input_error.h"

namespace swarmcert::analysis {
namespace {

namespace fs = std::filesystem;
using learning::LearningData;
using learning::Use;

const std::map<std::string, learning::Target> kTargets = {{"force_z", learning::Target::kForceZ},
                                                          {"force", learning::Target::kForce},
                                                          {"torque", learning::Target::kTorque}};
const std::map<std::string, learning::SplitBy> kSplits = {{"auto", learning::SplitBy::kAuto},
                                                          {"flights", learning::SplitBy::kFlights},
                                                          {"blocks", learning::SplitBy::kBlocks}};

struct TrainOptions {
  FlightOptions flights;
  std::vector<std::string> select, test;
  std::string output, report, quantity = "force_z", split = "auto";
  learning::NetworkSizes sizes;
  learning::RunOptions run;
  std::string gamma_scope = "layer", gamma_mode = "clip";
  std::string weights = "errors", symmetry = "vertical";
  bool no_ground = false, allow_worse = false;
  int teachers = 0;
};

/// Root mean square errors in the unit of the targets.
struct Scores {
  double nothing = 0, network = 0;

  /// Beyond what the order of two sums of float32 products can change.
  bool worse_than_none() const { return network > nothing * (1 + 1e-6); }
};

std::map<std::string, Scores> scores_by_composition(const LearningData& data, const training::Vector& theta,
                                                    Use use, int jobs) {
  std::map<std::string, std::vector<Eigen::Index>> members;
  for (const learning::TrackSamples& track : data.tracks) {
    if (track.use != use) continue;
    for (Eigen::Index s = track.begin; s < track.end; ++s) members[track.composition].push_back(s);
  }
  std::map<std::string, Scores> result;
  for (const auto& [composition, samples] : members) {
    double squares = 0;
    for (const Eigen::Index s : samples) squares += data.samples.target_of(s).cast<double>().squaredNorm();
    result[composition] = {std::sqrt(squares / static_cast<double>(samples.size())),
                           std::sqrt(training::mean_loss(data.layout, theta, data.samples, samples, jobs))};
  }
  return result;
}

/// Of each component of the target, over all samples that test.
std::vector<Scores> scores_by_component(const LearningData& data, const training::Vector& theta) {
  const std::vector<Eigen::Index> samples = data.indices(Use::kTest);
  const training::Matrix predicted = training::predict(data.layout, theta, data.samples, samples.data(),
                                                       static_cast<Eigen::Index>(samples.size()));
  Eigen::VectorXd nothing = Eigen::VectorXd::Zero(data.samples.outputs), network = nothing;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const training::Vector target = data.samples.target_of(samples[i]);
    nothing += target.cast<double>().cwiseAbs2();
    network += (target - predicted.col(static_cast<Eigen::Index>(i))).cast<double>().cwiseAbs2();
  }
  std::vector<Scores> result;
  for (Eigen::Index c = 0; c < nothing.size(); ++c) {
    result.push_back({std::sqrt(nothing[c] / static_cast<double>(samples.size())),
                      std::sqrt(network[c] / static_cast<double>(samples.size()))});
  }
  return result;
}

files::Json number_or_null(double x) { return std::isfinite(x) ? files::Json(x) : files::Json(); }

struct Outcome {
  learning::TaughtRun trained;
  Scores all;
  std::vector<Scores> components;  ///< x, y, z; empty where the target is one number
  std::map<std::string, Scores> compositions;
  Scores select;  ///< of the flights that decide whether there is to be a network
  std::map<std::string, Scores> select_compositions;
  std::map<std::string, double> scales;  ///< of each kind's output, see learning::output_scales()
  learning::Certified certified;

  /// A network that is worse than none on the selecting flights is not kept.
  bool kept() const {
    const bool silent = !scales.empty() && std::all_of(scales.begin(), scales.end(),
                                                       [](const auto& scale) { return scale.second == 0; });
    return !silent && !(select.network >= select.nothing);
  }
};

files::Json result_of(const TrainOptions& options, const std::vector<std::string>& inputs,
                      const LearningData& data, const Outcome& outcome) {
  files::Json json = result_head("train", inputs);
  json["seed"] = options.run.trainer.seed;
  json["gamma"] = options.run.trainer.gamma.value;
  json["max_lipschitz"] =
      options.run.max_lipschitz > 0 ? files::Json(options.run.max_lipschitz) : files::Json();
  json["samples"] = {{"fit", data.indices(Use::kFit).size()},
                     {"select", data.indices(Use::kSelect).size()},
                     {"test", data.indices(Use::kTest).size()}};
  const learning::TargetInfo& target = learning::info(data.target);
  const double SI = target.SI_per_unit;
  json["quantity"] = target.quantity;
  json["split"] = data.split_by_blocks ? "blocks" : "flights";
  json["test_rmse"] = number_or_null(outcome.all.network * SI);
  json["test_rmse_" + std::string(target.unit)] = number_or_null(outcome.all.network);
  json["test_rmse_of_nothing"] = number_or_null(outcome.all.nothing * SI);
  for (std::size_t c = 0; c < outcome.components.size(); ++c) {
    const std::string axis(1, "xyz"[c]);
    json["test_rmse_axes"][axis] = number_or_null(outcome.components[c].network * SI);
    json["test_rmse_of_nothing_axes"][axis] = number_or_null(outcome.components[c].nothing * SI);
  }
  json["test"] = files::Json::array();
  for (const auto& [composition, scores] : outcome.compositions) {
    json["test"].push_back(
        {{"vehicles", composition}, {"rmse", scores.network * SI}, {"rmse_of_nothing", scores.nothing * SI}});
  }
  json["kept"] = outcome.kept();
  json["output_scales"] = outcome.scales;
  json["select_rmse"] = number_or_null(outcome.select.network * SI);
  json["select_rmse_of_nothing"] = number_or_null(outcome.select.nothing * SI);
  json["select"] = files::Json::array();
  for (const auto& [composition, scores] : outcome.select_compositions) {
    json["select"].push_back({{"vehicles", composition},
                              {"rmse", scores.network * SI},
                              {"rmse_of_nothing", scores.nothing * SI},
                              {"worse_than_none", scores.worse_than_none()}});
  }
  json["bounds"] = files::Json::array();
  for (const auto& [function, upper] : outcome.certified.set_bounds)
    json["bounds"].push_back({{"function", function},
                              {"upper", upper},
                              {"unit", fmt::format("{} per unit of input", target.unit)}});
  json["lipschitz"] = outcome.certified.largest();
  json["gamma_verdict"] = name(outcome.certified.gamma);
  json["teachers"] = files::Json::array();
  const learning::TaughtRun& trained = outcome.trained;
  const auto json_of = [&target](const learning::Score& score) {
    return files::Json{{"seed", score.seed},
                       {"best_epoch", score.best_epoch + 1},
                       {fmt::format("select_rmse_{}", target.unit), score.select_rmse}};
  };
  for (std::size_t i = 0; i + 1 < trained.scores.size(); ++i)
    json["teachers"].push_back(json_of(trained.scores[i]));
  json["taught"] = trained.scores.size() > 1 ? json_of(trained.scores.back()) : files::Json();
  json["kept_seed"] = trained.kept_score().seed;
  json["best_epoch"] = trained.run.best_epoch + 1;
  json["epochs"] = files::Json::array();
  for (const learning::Epoch& epoch : trained.run.epochs)
    json["epochs"].push_back({{fmt::format("fit_rmse_{}", target.unit), epoch.fit_rmse},
                              {fmt::format("select_rmse_{}", target.unit), epoch.select_rmse}});
  json["problems"] = data.problems;
  return json;
}

/// Where the selecting flights are better off without the network.
void print_worse_than_none(const Outcome& outcome, const std::string& unit) {
  if (!outcome.kept()) {
    fmt::print(
        "no network is kept: on the selecting flights it leaves {:.3f} {}, none {:.3f}; the models written "
        "are "
        "without it\n",
        outcome.select.network, unit, outcome.select.nothing);
  }
  for (const auto& [composition, scores] : outcome.select_compositions) {
    if (!scores.worse_than_none()) continue;
    fmt::print("warning: worse than none for {}: {:.3f} {} on the selecting flights, {:.3f} without\n",
               composition, scores.network, unit, scores.nothing);
  }
}

void print(const TrainOptions& options, const LearningData& data, const Outcome& outcome) {
  std::map<std::string, int> flights[3];
  for (const learning::TrackSamples& track : data.tracks)
    ++flights[static_cast<int>(track.use)][track.flight];
  fmt::print("{} samples: {} to fit ({} flights), {} to select ({}), {} to test ({})\n",
             data.samples.samples(), data.indices(Use::kFit).size(), flights[0].size(),
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
  for (const auto& [kind, scale] : outcome.scales) {
    if (scale == 0) {
      fmt::print("no network for {}: the selecting flights have a composition that is better off without\n",
                 kind);
    } else if (scale < 1) {
      fmt::print(
          "output for {} scaled by {:.3f}: no composition of the selecting flights is worse than without\n",
          kind, scale);
    }
  }
  for (const std::string& problem : data.problems) fmt::print("left out: {}\n", problem);
  print_worse_than_none(outcome, target.unit);
  fmt::print("written: {}/network.toml, weights, certificate.json, models\n", options.output);
}

/// A run that was killed before its first epoch ended left nothing: --resume then begins, so that a job that is
/// started again needs no other words.
void choose_beginning(const CommonOptions& common, TrainOptions& options) {
  if (fs::exists(options.output) && !fs::is_directory(options.output))
    throw files::InputError({options.output, "", "-o", "", "is a file", "name a folder"});
  options.run.checkpoint = (fs::path(options.output) / "checkpoint.json").string();
  if (!fs::exists(options.output) || fs::is_empty(options.output)) {
    options.run.resumes = false;
    return;
  }
  const std::uint64_t first = options.run.trainer.seed + (options.teachers > 0 ? 1 : 0);
  if (options.run.resumes && !fs::exists(learning::checkpoint_of(options.run, first)))
    throw files::InputError({options.output, "", "--resume", "",
                             fmt::format("the folder holds no interrupted run of seed {}", first),
                             "name the folder and the seed of one, or begin anew with --force instead"});
  if (!options.run.resumes && !common.force)
    throw files::InputError({options.output, "", "-o", "", "the folder is not empty",
                             "--resume goes on with the run in it, --force replaces it"});
}

/// Flights that are not fitted, with the same models; nothing where none are named.
std::optional<residuals::Inputs> others(const TrainOptions& options, const std::vector<std::string>& words) {
  if (words.empty()) return std::nullopt;
  FlightOptions chosen = options.flights;
  chosen.words = words;
  for (const std::string& word : options.flights.words) {
    if (fs::path(word).extension() == ".toml") chosen.models.push_back(word);
  }
  return read_flights(chosen, true, false, true);
}

/// A flight that is fitted and judges as well would make errors look too good without a word.
void refuse_twice(const learning::LearningFlights& flights) {
  std::set<std::string> seen;
  for (const residuals::Inputs* inputs : {flights.fit, flights.select, flights.test}) {
    if (inputs == nullptr) continue;
    for (const residuals::FlightFiles& flight : inputs->found.flights) {
      const std::string file = fs::weakly_canonical(flight.logs[0].second).string();
      if (!seen.insert(file).second)
        throw UsageError("one flight for two uses: " + flight.logs[0].second +
                         " is named to fit, to select or to test more than once");
    }
  }
}

/// Sets the options of the trainer that the command line gives as words.
void choose_trainer(const CommonOptions& common, TrainOptions& options) {
  options.sizes.ground = !options.no_ground;
  training::TrainerOptions& trainer = options.run.trainer;
  trainer.gamma.scope = options.gamma_scope == "layer" ? files::GammaStatement::Scope::kLayer
                                                       : files::GammaStatement::Scope::kNetwork;
  trainer.gamma.mode =
      options.gamma_mode == "clip" ? files::GammaStatement::Mode::kClip : files::GammaStatement::Mode::kEqual;
  trainer.jobs = common.jobs;
  trainer.turns = options.symmetry == "vertical";
  options.run.weighing =
      options.weights == "errors" ? learning::Weighing::kErrors : learning::Weighing::kGroups;
  if (options.run.max_lipschitz > 0 && options.gamma_mode == "equal")
    throw UsageError("--max-lipschitz scales layers, which --gamma-mode equal forbids");
}

/// Certifies the network that was written, and scores it on the flights of the test.
void certify_and_score(const TrainOptions& options, int jobs, const LearningData& data,
                       const files::Network& network, Outcome& outcome) {
  const learning::Run& run = outcome.trained.run;
  lipschitz::CertifyOptions certify_options;
  certify_options.jobs = jobs;
  certify_options.lower.seed = options.run.trainer.seed;
  outcome.certified = learning::write_certificate(network, options.output, certify_options);
  outcome.all = {learning::rmse_of_nothing(data, Use::kTest),
                 learning::rmse(data, run.theta, Use::kTest, jobs)};
  if (data.samples.outputs > 1) outcome.components = scores_by_component(data, run.theta);
  outcome.compositions = scores_by_composition(data, run.theta, Use::kTest, jobs);
}

/// Every file that was read, each once.
std::vector<std::string> files_of(const learning::LearningFlights& flights) {
  std::vector<std::string> files = flights.fit->files();
  for (const residuals::Inputs* more : {flights.select, flights.test}) {
    if (more == nullptr) continue;
    for (const std::string& file : more->files()) {
      if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
    }
  }
  return files;
}

int run_train(TrainOptions options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  choose_beginning(common, options);
  refuse_folder(common, options.report);
  choose_trainer(common, options);
  const residuals::Inputs inputs = read_flights(options.flights, true, false, true);
  const std::optional<residuals::Inputs> select = others(options, options.select);
  const std::optional<residuals::Inputs> test = others(options, options.test);
  const learning::LearningFlights flights = {&inputs, select ? &*select : nullptr, test ? &*test : nullptr};
  refuse_twice(flights);
  Progress loading(common.quiet);
  const LearningData data = learning::load_learning_data(
      flights, options.sizes, kSplits.at(options.split), common.jobs,
      [&](int done, int total) { loading.show(done, total, "flights"); }, kTargets.at(options.quantity));
  fs::create_directories(options.output);
  Progress training_progress(common.quiet);
  options.run.progress = [&](int done, int total, double select_gf) {
    training_progress.show(done, total,
                           fmt::format("epochs, {:.3f} {}", select_gf, learning::info(data.target).unit));
  };
  const CancelOnInterrupt interrupt;
  options.run.cancelled = interrupt.flag();
  Outcome outcome;
  outcome.trained = learning::run_with_teachers(data, options.run, options.teachers);
  learning::Run& run = outcome.trained.run;
  if (run.was_cancelled) {
    note(fmt::format("stopped after {} epochs{}; --resume goes on", run.epochs.size(),
                     options.teachers > 0 ? fmt::format(" of seed {}", run.seed) : ""));
    return kInconclusive;
  }

  if (options.run.trainer.gamma.mode == files::GammaStatement::Mode::kClip && !options.allow_worse) {
    outcome.scales = learning::output_scales(data, run.theta);
    learning::scale_outputs(data.layout, outcome.scales, run.theta);
  }
  const files::Network network =
      learning::write_network(data, run.theta, options.run.trainer.gamma, options.output);
  outcome.select = {learning::rmse_of_nothing(data, Use::kSelect),
                    learning::rmse(data, run.theta, Use::kSelect, common.jobs)};
  outcome.select_compositions = scores_by_composition(data, run.theta, Use::kSelect, common.jobs);
  learning::write_models(inputs, data.layout, options.output, outcome.kept());
  certify_and_score(options, common.jobs, data, network, outcome);

  const files::Json result = result_of(options, files_of(flights), data, outcome);
  write_result(common, result);
  if (common.prints_text()) print(options, data, outcome);
  if (!options.report.empty()) {
    const std::string path = write_train_report(data, run, result, options.report, common.force);
    if (common.prints_text()) fmt::print("report: {}\n", path);
  }
  for (const learning::Score& score : outcome.trained.scores)
    fs::remove(learning::checkpoint_of(options.run, score.seed));
  return kDone;
}

}  // namespace

Command train_command() {
  return {
      "train", "Train spectrally normalised deep sets on flights, with a certificate of the result",
      "The network learns what the vehicles' models leave of the vertical force, of the force, or of the "
      "torque. A phi per kind\nof neighbour, a rho per kind of vehicle, and a phi of the own state for the "
      "ground. Flights are split as wholes into fit,\nselect and test; the epoch with the least error on "
      "the selecting flights is kept, and projected so that gamma holds in\nexact arithmetic. An "
      "interrupted run goes on with --resume. What is flown is the vertical force; networks of a force or\n"
      "torque act as effects of models, in simulation and in compare; simulate --torque-network flies a "
      "torque.\n\n"
      "Example: swarmcert train flights/ --epochs 20 -o trained",
      [](CLI::App& app) {
        const auto options = std::make_shared<TrainOptions>();
        training::TrainerOptions& trainer = options->run.trainer;
        trainer.gamma.value = 3;
        declare_flights(app, options->flights, true);
        add_output(app, "-o,--output", options->output, "Folder for networks, certificate and models")
            ->required();
        app.add_option("--quantity", options->quantity,
                       "force_z, force (x, y, z) or torque (x, y, z; needs logs of at least 400 Hz)")
            ->check(CLI::IsMember({"force_z", "force", "torque"}))
            ->capture_default_str();
        app.add_option("--test", options->test, "Flights that only test; without it every fifth flight does");
        app.add_option("--select", options->select,
                       "Flights that only decide when training ends; without it every fifth flight does");
        app.add_option("--split", options->split,
                       "How FLIGHTS are held back where --select or --test name none: whole flights, or "
                       "blocks of 2 s of each (auto: blocks where there are too few flights)")
            ->check(CLI::IsMember({"auto", "flights", "blocks"}))
            ->capture_default_str();
        app.add_option("--gamma", trainer.gamma.value, "Limit of the spectral norms")
            ->check(CLI::PositiveNumber)
            ->capture_default_str();
        app.add_option("--gamma-scope", options->gamma_scope,
                       "Whether gamma limits every layer's norm, or the product over a network's layers")
            ->check(CLI::IsMember({"layer", "network"}))
            ->capture_default_str();
        app.add_option("--gamma-mode", options->gamma_mode,
                       "clip: at most the limit; equal: always the limit")
            ->check(CLI::IsMember({"clip", "equal"}))
            ->capture_default_str();
        app.add_option("--max-lipschitz", options->run.max_lipschitz,
                       "Limit of the joint Lipschitz bounds in gf (torque: mN m) per unit of input, proved; "
                       "layers that reach it "
                       "are clipped below gamma")
            ->check(CLI::PositiveNumber);
        app.add_option("--weights", options->weights,
                       "Scenarios and the compositions of kinds in them count the same (scenarios), or the "
                       "same relative "
                       "to their own errors (errors)")
            ->check(CLI::IsMember({"scenarios", "errors"}))
            ->capture_default_str();
        app.add_option("--symmetry", options->symmetry,
                       "vertical: every epoch turns every sample about the vertical and mirrors it, its "
                       "force or torque "
                       "included; none: samples as recorded")
            ->check(CLI::IsMember({"vertical", "none"}))
            ->capture_default_str();
        app.add_option("--phi", options->sizes.phi, "Hidden layers of phi")
            ->delimiter(',')
            ->check(CLI::Range(1, 4096))
            ->capture_default_str();
        app.add_option("--rho", options->sizes.rho, "Hidden layers of rho")
            ->delimiter(',')
            ->check(CLI::Range(1, 4096))
            ->capture_default_str();
        app.add_option("--features", options->sizes.features, "Width between phi and rho")
            ->check(CLI::Range(1, 4096))
            ->capture_default_str();
        app.add_flag("--no-ground", options->no_ground, "Leave out the phi of the own state");
        app.add_flag("--allow-worse", options->allow_worse,
                     "Keep each kind's output as trained; without it, outputs are scaled down until no "
                     "composition of the selecting flights is worse than without the network (not with "
                     "--gamma-mode equal)");
        app.add_option("--epochs", options->run.epochs, "Maximum number of epochs")
            ->check(CLI::Range(1, 100000))
            ->capture_default_str();
        app.add_option("--patience", options->run.patience,
                       "Epochs without improvement after which training stops")
            ->check(CLI::Range(1, 100000))
            ->capture_default_str();
        app.add_option("--rate", trainer.learning_rate, "Initial learning rate")
            ->check(CLI::PositiveNumber)
            ->capture_default_str();
        app.add_option("--batch", trainer.batch, "Samples per step")
            ->check(CLI::Range(1, 1 << 20))
            ->capture_default_str();
        app.add_option("--seed", trainer.seed, "Seed of the initial weights and of the sample order")
            ->capture_default_str();
        app.add_option("--teachers", options->teachers,
                       "First train this many networks, with the seeds after --seed, then train one network "
                       "on their averaged predictions (distillation); the one with the smallest error on the "
                       "selecting flights is written")
            ->check(CLI::Range(0, 1000))
            ->capture_default_str();
        leave_out_of_record(app.add_flag("--resume", options->run.resumes,
                                         "Go on with an interrupted run in the same folder"));
        app.add_flag("--published-filter", options->flights.published_filter,
                     "Cut and filter as the networks' authors did, see compare");
        app.add_flag("--published-signals", options->flights.published_signals,
                     "Only the thrust lag, masses and unfiltered accelerometer of --published-filter");
        add_output(app, "--report", options->report, "Write an HTML report into this folder");
        return [options](const CommonOptions& common) { return run_train(*options, common); };
      }};
}

}  // namespace swarmcert::analysis

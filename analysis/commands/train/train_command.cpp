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
#include "analysis/commands/train/train_options.h"
#include "analysis/commands/train/train_output.h"
#include "analysis/commands/train/train_report.h"
#include "analysis/learning/cross_fit.h"
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

const std::map<std::string, training::Layers> kLayers = {{"free", training::Layers::kFree},
                                                         {"aol", training::Layers::kAol},
                                                         {"orthogonal", training::Layers::kOrthogonal},
                                                         {"sandwich", training::Layers::kSandwich}};

/// Sums of squares of targets, and of the residuals that the outputs leave.
struct Squares {
  double nothing = 0, network = 0, samples = 0;
  Scores scores() const { return {std::sqrt(nothing / samples), std::sqrt(network / samples)}; }
};

/// Scores of the samples of `use` by composition; `all` is NaN if there are none.
/// @param outputs [outputs x samples] outputs of the network for all samples.
std::map<std::string, Scores> scores_by_composition(const LearningData& data, const training::Matrix& outputs,
                                                    Use use, Scores& all) {
  std::map<std::string, Squares> sums;
  Squares total;
  for (const learning::TrackSamples& track : data.tracks) {
    if (track.use != use) continue;
    Squares& sum = sums[track.composition];
    for (Eigen::Index s = track.begin; s < track.end; ++s) {
      const Eigen::VectorXd y = data.samples.target_of(s).cast<double>();
      const double nothing = y.squaredNorm(), network = (y - outputs.col(s).cast<double>()).squaredNorm();
      for (Squares* const some : {&sum, &total}) {
        some->nothing += nothing;
        some->network += network;
        some->samples += 1;
      }
    }
  }
  all = total.scores();
  std::map<std::string, Scores> result;
  for (const auto& [composition, sum] : sums) result[composition] = sum.scores();
  return result;
}

/// Scores of each component of the target over all test samples.
std::vector<Scores> scores_by_component(const LearningData& data, const training::Matrix& outputs) {
  std::vector<Squares> sums(static_cast<std::size_t>(data.samples.outputs));
  for (const Eigen::Index s : data.indices(Use::kTest)) {
    const Eigen::VectorXd y = data.samples.target_of(s).cast<double>();
    const Eigen::VectorXd left = y - outputs.col(s).cast<double>();
    for (std::size_t c = 0; c < sums.size(); ++c) {
      sums[c].nothing += y[static_cast<Eigen::Index>(c)] * y[static_cast<Eigen::Index>(c)];
      sums[c].network += left[static_cast<Eigen::Index>(c)] * left[static_cast<Eigen::Index>(c)];
      sums[c].samples += 1;
    }
  }
  std::vector<Scores> result;
  for (const Squares& sum : sums) result.push_back(sum.scores());
  return result;
}

/// A run that was killed before the end of its first epoch has left nothing; --resume then starts from the beginning,
/// so that a restarted job can use the same command line.
void choose_beginning(const CommonOptions& common, TrainOptions& options) {
  if (fs::exists(options.output) && !fs::is_directory(options.output))
    throw files::InputError({options.output, "", "-o", "", "is a file", "name a folder"});
  options.run.checkpoint = (fs::path(options.output) / "checkpoint.json").string();
  if (!fs::exists(options.output) || fs::is_empty(options.output)) {
    options.run.resumes = false;
    return;
  }
  const std::uint64_t first =
      options.run.trainer.seed + (options.teachers > 0 ? 1 : 0);  // the first fold also uses this seed
  if (options.run.resumes && !fs::exists(learning::checkpoint_of(options.run, first)))
    throw files::InputError({options.output, "", "--resume", "",
                             fmt::format("the folder holds no interrupted run of seed {}", first),
                             "name the folder and the seed of one, or start over with --force instead"});
  if (!options.run.resumes && !common.force)
    throw files::InputError({options.output, "", "-o", "", "the folder is not empty",
                             "--resume goes on with the run in it, --force replaces it"});
}

/// Flights that are not fitted, with the same models; nothing if none are named.
std::optional<residuals::Inputs> others(const TrainOptions& options, const std::vector<std::string>& words) {
  if (words.empty()) return std::nullopt;
  FlightOptions chosen = options.flights;
  chosen.words = words;
  for (const std::string& word : options.flights.words) {
    if (fs::path(word).extension() == ".toml") chosen.models.push_back(word);
  }
  return read_flights(chosen, true, false, true);
}

/// Rejects flights that are both fitted and used to judge, since the errors would silently look too good.
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

/// Rejects options that conflict with --folds, where the flights left out of each fit are the selecting flights.
void check_folds(const TrainOptions& options) {
  if (options.folds == 0) return;
  if (options.folds == 1) throw UsageError("--folds 1 leaves no flight to fit: give at least 2");
  if (options.teachers > 0 || !options.select.empty())
    throw UsageError(std::string(options.teachers > 0 ? "--teachers" : "--select") +
                     " and --folds are two ways to select: give one of them");
  if (options.gamma_mode == "equal")
    throw UsageError("--folds averages networks, which --gamma-mode equal forbids");
}

/// Converts trainer options given as words on the command line.
void choose_trainer(const CommonOptions& common, TrainOptions& options) {
  options.sizes.ground = !options.no_ground;
  training::TrainerOptions& trainer = options.run.trainer;
  trainer.gamma.scope = options.gamma_scope == "layer" ? files::GammaStatement::Scope::kLayer
                                                       : files::GammaStatement::Scope::kNetwork;
  trainer.gamma.mode =
      options.gamma_mode == "clip" ? files::GammaStatement::Mode::kClip : files::GammaStatement::Mode::kEqual;
  trainer.layers = kLayers.at(options.layers);
  trainer.jobs = common.jobs;
  trainer.turns = options.symmetry == "vertical";
  options.run.weighing =
      options.weights == "errors" ? learning::Weighing::kErrors : learning::Weighing::kGroups;
  if (options.run.max_lipschitz > 0 && options.gamma_mode == "equal")
    throw UsageError("--max-lipschitz scales layers, which --gamma-mode equal forbids");
  if (options.layers != "free" && options.gamma_mode == "equal")
    throw UsageError("--gamma-mode equal is for --layers free");
}

/// Certifies the network that was written, and scores it on the test flights.
void certify_and_score(const TrainOptions& options, int jobs, const LearningData& data,
                       const files::Network& network, Outcome& outcome) {
  const learning::Run& run = outcome.trained.run;
  lipschitz::CertifyOptions certify_options;
  certify_options.jobs = jobs;
  certify_options.lower.seed = options.run.trainer.seed;
  outcome.certified = learning::write_certificate(network, options.output, certify_options);
  training::Matrix outputs = learning::outputs_for(data, run.theta, Use::kTest);
  learning::silence(data, outcome.support, outputs);
  outcome.compositions = scores_by_composition(data, outputs, Use::kTest, outcome.all);
  if (data.samples.outputs > 1) outcome.components = scores_by_component(data, outputs);
}

/// Scales the outputs by the selecting flights, and finds the compositions without a network unless told not to.
/// Without folds the selecting flights are flights of their own; with folds they are all flights, each evaluated by
/// the network that was not fitted to it.
void select_and_scale(const TrainOptions& options, const LearningData& data, training::Matrix unseen,
                      Outcome& outcome) {
  training::Vector& theta = outcome.trained.run.theta;
  const Use use = options.folds > 0 ? Use::kFit : Use::kSelect;
  const training::Matrix whole = learning::outputs_for(data, theta, use);
  if (options.folds == 0) unseen = whole;
  const bool may_scale = options.run.trainer.gamma.mode == files::GammaStatement::Mode::kClip;
  outcome.support = learning::output_support(data, unseen, whole, use,
                                             options.allow_worse ? learning::Support::kAsTrained
                                             : may_scale         ? learning::Support::kScaleAndSilence
                                                                 : learning::Support::kSilence);
  learning::scale_outputs(data.layout, outcome.support.scales, theta);
}

/// All files that were read, without duplicates.
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
  check_folds(options);
  const residuals::Inputs inputs = read_flights(options.flights, true, false, true);
  const std::optional<residuals::Inputs> select = others(options, options.select);
  const std::optional<residuals::Inputs> test = others(options, options.test);
  const learning::LearningFlights flights = {&inputs, select ? &*select : nullptr, test ? &*test : nullptr};
  refuse_twice(flights);
  Progress loading(common.quiet);
  LearningData data = learning::load_learning_data(
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
  training::Matrix unseen;
  if (options.folds > 0) {
    learning::CrossFit fit = learning::cross_fit(options.run, options.folds, data);
    outcome.trained.run = std::move(fit.run);
    outcome.members = std::move(fit.members);
    unseen = std::move(fit.unseen);
  } else {
    outcome.trained = learning::run_with_teachers(data, options.run, options.teachers);
  }
  const learning::Run& run = outcome.trained.run;
  if (run.was_cancelled) {
    note(fmt::format("stopped after {} epochs{}; --resume goes on", run.epochs.size(),
                     options.teachers + options.folds > 0 ? fmt::format(" of seed {}", run.seed) : ""));
    return kInconclusive;
  }

  select_and_scale(options, data, std::move(unseen), outcome);
  const files::Network network = learning::write_network(data, run.theta, options.run.trainer.gamma,
                                                         options.output, outcome.support.silent_names());
  learning::write_models(inputs, data.layout, options.output, outcome.kept());
  certify_and_score(options, common.jobs, data, network, outcome);

  const files::Node result =
      described_result("train", files_of(flights), options.run.trainer.seed,
                       [&](files::Record& record) { describe_training(record, options, data, outcome); });
  write_result(common, result);
  if (common.prints_text()) print_training(options, data, outcome);
  if (!options.report.empty()) {
    const std::string path =
        write_train_report(data, run, outcome.support, result, options.report, common.force);
    if (common.prints_text()) fmt::print("report: {}\n", path);
  }
  for (const std::vector<learning::Score>* scores : {&outcome.trained.scores, &outcome.members}) {
    for (const learning::Score& score : *scores) fs::remove(learning::checkpoint_of(options.run, score.seed));
  }
  print_next(common, {"export", options.output + "/network.toml", "--certificate",
                      options.output + "/certificate.json", "-o", "firmware"});
  return kDone;
}

}  // namespace

Command train_command() {
  return {
      "train", "Train spectrally normalised deep sets on flights, with a certificate of the result",
      "The network learns the residual of the vehicles' models: the vertical force, the force, or the "
      "torque. A phi per kind\nof neighbour, a rho per kind of vehicle, and a phi of the own state for the "
      "ground. Flights are split as wholes into fit,\nselect and test; the epoch with the least error on "
      "the selecting flights is kept, and projected so that gamma holds in\nexact arithmetic. With --folds "
      "every flight that does not test is fitted. Compositions\nin which the selecting flights are better "
      "off without a network get none: see silent in network.toml. An "
      "interrupted run goes on with --resume. The controller uses the vertical force; networks of a force "
      "or\n"
      "torque act as effects of models, in simulation and in compare; simulate --torque-network flies a "
      "torque.\n\n"
      "Example: swarmcert train flights/ --epochs 20 -o trained",
      [](CLI::App& app) {
        const auto options = std::make_shared<TrainOptions>();
        declare_train_options(app, *options);
        return [options](const CommonOptions& common) { return run_train(*options, common); };
      },
      [](files::Record& record) { describe_training(record, {}, {}, {}); }};
}

}  // namespace swarmcert::analysis

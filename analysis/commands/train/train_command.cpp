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
  options.sizes.invariants = options.symmetry == "exact";
  if (options.sizes.invariants && options.quantity != "force_z")
    throw UsageError("--symmetry exact is for the vertical force; with --quantity " + options.quantity +
                     " use --symmetry vertical");
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

  const files::Json result = train_json(options, files_of(flights), data, outcome);
  write_result(common, result);
  if (common.prints_text()) print_training(options, data, outcome);
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
        declare_train_options(app, *options);
        return [options](const CommonOptions& common) { return run_train(*options, common); };
      }};
}

}  // namespace swarmcert::analysis

#include "analysis/reproduction/learn.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/learning/cross_fit.h"
#include "analysis/learning/trained_network.h"
#include "nn/base/file_io.h"
#include "nn/base/shard.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;
using learning::Use;

constexpr const char* kLearnSchema = "swarmcert/learned/2";

std::string text_of(const LearnOptions& options) {
  std::string text = fmt::format("best of teachers and taught {} {} {} {} {} {} {} {} {} {} {} {} {}",
                                 options.gamma.value, static_cast<int>(options.gamma.scope),
                                 static_cast<int>(options.gamma.mode), options.max_lipschitz, options.turns,
                                 options.rate, options.batch, options.steps, options.epochs, options.seed,
                                 options.teachers, options.sizes.features, options.sizes.ground);
  if (options.tight_bounds) text += " tight bounds";
  if (options.layers != training::Layers::kFree)
    text += fmt::format(" layers {}", static_cast<int>(options.layers));
  if (options.max_lipschitz > 0 && !options.begins_within) text += " begins outside";
  if (options.folds > 0) text += fmt::format(" folds {}", options.folds);
  if (options.patience > 0) text += fmt::format(" patience {}", options.patience);
  for (const int size : options.sizes.phi) text += fmt::format(" phi {}", size);
  for (const int size : options.sizes.rho) text += fmt::format(" rho {}", size);
  return text;
}

Learned read_back(const files::Json& file, const std::string& folder) {
  Learned learned;
  learned.folder = folder;
  learned.network = files::load_network({{}, (fs::path(folder) / "network.toml").string(), "", ""});
  for (const files::Json& bound : file.at("set_bounds"))
    learned.set_bounds.emplace_back(bound.at(0).get<std::string>(), bound.at(1).get<double>());
  learned.bound = file.at("bound").get<double>();
  learned.keeps_gamma = file.at("keeps_gamma").get<bool>();
  learned.test_gf = file.at("test_gf").get<double>();
  learned.nothing_gf = file.at("nothing_gf").get<double>();
  learned.samples = file.at("samples").get<int>();
  learned.epochs = file.at("epochs").get<int>();
  learned.best_epoch = file.at("best_epoch").get<int>();
  learned.kept_seed = file.at("kept_seed").get<std::uint64_t>();
  for (const files::Json& score : file.at("scores"))
    learned.scores.emplace_back(score.at(0).get<std::uint64_t>(), score.at(1).get<double>());
  for (const auto& [kind, scale] : file.at("output_scales").items())
    learned.support.scales[kind] = scale.get<double>();
  for (const auto& [composition, errors] : file.at("silent").items())
    learned.support.silent[composition] = {errors.at(0).get<double>(), errors.at(1).get<double>(), 0};
  return learned;
}

/// The trained network, however it was trained.
struct Trained {
  learning::Run run;
  std::vector<learning::Score> scores;
  learning::OutputSupport support;
};

/// Trains the mean of the networks of the folds, scaled and silenced by their outputs on unseen flights.
Trained train_folds(const learning::RunOptions& run, int folds, learning::LearningData& data) {
  learning::CrossFit fit = learning::cross_fit(run, folds, data);
  Trained trained = {std::move(fit.run), std::move(fit.members), {}};
  const training::Matrix whole = learning::outputs_for(data, trained.run.theta, Use::kFit);
  trained.support = learning::output_support(data, fit.unseen, whole, Use::kFit);
  learning::scale_outputs(data.layout, trained.support.scales, trained.run.theta);
  return trained;
}

Trained train_one(const learning::RunOptions& run, int teachers, const learning::LearningData& data) {
  learning::TaughtRun taught = learning::run_with_teachers(data, run, teachers);
  return {std::move(taught.run), std::move(taught.scores), {}};
}

/// Error on the test flights, gf; NaN if there are none.
double test_gf(const learning::LearningData& data, const Trained& trained, int jobs) {
  if (trained.support.silent.empty()) return learning::rmse(data, trained.run.theta, Use::kTest, jobs);
  training::Matrix outputs = learning::outputs_for(data, trained.run.theta, Use::kTest);
  learning::silence(data, trained.support, outputs);
  const std::vector<Eigen::Index> samples = data.indices(Use::kTest);
  double squares = 0;
  for (const Eigen::Index s : samples)
    squares += (data.samples.target_of(s) - outputs.col(s)).cast<double>().squaredNorm();
  return std::sqrt(squares / static_cast<double>(samples.size()));
}

/// Trains, writes network and certificate into `folder`, and returns the measurements.
/// @param checkpoints files that are no longer needed once these are stored.
files::Json train(const Setting& setting, const LearnOptions& options, const std::string& folder,
                  const std::string& hash, learning::LearningData data,
                  std::vector<std::string>& checkpoints) {
  fs::create_directories(folder);
  learning::RunOptions run;
  run.trainer.gamma = options.gamma;
  run.trainer.learning_rate = options.rate;
  run.trainer.batch = options.batch;
  run.trainer.layers = options.layers;
  run.trainer.turns = options.turns;
  run.max_lipschitz = options.max_lipschitz;
  run.begins_within = options.begins_within;
  run.trainer.seed = options.seed;
  run.trainer.jobs = setting.jobs;
  const auto samples = static_cast<int>(data.indices(Use::kFit).size());
  const int per_epoch = (samples + options.batch - 1) / options.batch;
  run.epochs = options.steps > 0 ? std::max(1, (options.steps + per_epoch / 2) / per_epoch) : options.epochs;
  run.patience = options.patience > 0 ? options.patience : run.epochs;
  run.checkpoint = (fs::path(folder) / ("checkpoint-" + hash.substr(0, 12) + ".json")).string();
  const std::uint64_t first = options.seed + (options.teachers > 0 ? 1 : 0);
  run.resumes = fs::exists(learning::checkpoint_of(run, first));
  run.progress = [&](int epochs, int total, double select_gf) {
    setting.progress(epochs, total, fmt::format("epochs, {:.3f} gf", select_gf));
  };
  const Trained found =
      options.folds > 0 ? train_folds(run, options.folds, data) : train_one(run, options.teachers, data);
  const learning::Run& trained = found.run;
  const files::Network network =
      learning::write_network(data, trained.theta, options.gamma, folder, found.support.silent_names());
  lipschitz::CertifyOptions certify;
  certify.jobs = setting.jobs;
  certify.lower.rounds = 0;  // only upper bounds are shown
  if (!setting.full && options.max_lipschitz == 0 && !options.tight_bounds)
    certify.method = lipschitz::UpperMethod::kProduct;  // looser, but immediate
  const learning::Certified certified = learning::write_certificate(network, folder, certify);
  files::Json bounds = files::Json::array(), epochs = files::Json::array(), scores = files::Json::array();
  for (const learning::Score& score : found.scores) scores.push_back({score.seed, score.select_rmse});
  for (const auto& [function, upper] : certified.set_bounds) bounds.push_back({function, upper});
  for (const learning::Epoch& epoch : trained.epochs) epochs.push_back({epoch.fit_rmse, epoch.select_rmse});
  files::Json silent = files::Json::object();
  for (const auto& [composition, errors] : found.support.silent)
    silent[composition] = {errors.network, errors.nothing};
  for (const learning::Score& score : found.scores)
    checkpoints.push_back(learning::checkpoint_of(run, score.seed));
  return {{"set_bounds", std::move(bounds)},
          {"bound", certified.largest()},
          {"keeps_gamma", certified.gamma == lipschitz::Verdict::kProved},
          {"test_gf", test_gf(data, found, setting.jobs)},
          {"nothing_gf", learning::rmse_of_nothing(data, Use::kTest)},
          {"samples", samples},
          {"epochs", trained.epochs.size()},
          {"best_epoch", trained.best_epoch + 1},
          {"fit_and_select_gf", std::move(epochs)},
          {"kept_seed", trained.seed},
          {"output_scales", found.support.scales},
          {"silent", std::move(silent)},
          {"scores", std::move(scores)}};
}

}  // namespace

Learned learn(const Setting& setting, const LearnOptions& options, const std::string& folder,
              const std::string& key, const std::function<learning::LearningData()>& load) {
  const std::string whole_key = key + "|" + text_of(options);
  std::vector<std::string> checkpoints;
  const files::Json learned = files::kept_unit(
      (fs::path(folder) / "learned.json").string(), kLearnSchema, whole_key,
      [&] { return train(setting, options, folder, files::sha256(whole_key), load(), checkpoints); });
  for (const std::string& checkpoint : checkpoints) fs::remove(checkpoint);
  return read_back(learned, folder);
}

}  // namespace swarmcert::reproduction

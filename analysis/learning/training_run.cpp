#include "analysis/learning/training_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include "analysis/learning/lipschitz_limit.h"
#include "analysis/learning/projection.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/base/pi.h"

namespace swarmcert::learning {
namespace {

using training::Vector;

/// The state from which a run can be resumed.
struct State {
  Vector trainer, best;
  std::vector<double> shares;  ///< factors on the limits of the layers, per part
  std::vector<Epoch> epochs;
};

/// Hash of the data and of every option on which the bits depend; only an identical run may resume from a checkpoint.
std::string fingerprint(const LearningData& data, const RunOptions& options) {
  const auto bytes = [](const auto& v) {
    return std::string(reinterpret_cast<const char*>(v.data()), v.size() * sizeof(v[0]));
  };
  std::string text = bytes(data.samples.x) + bytes(data.samples.phi) + bytes(data.samples.first) +
                     bytes(data.samples.rho) + bytes(data.samples.target) + bytes(data.samples.weight);
  for (const TrackSamples& track : data.tracks) text += name(track.use) + std::to_string(track.end);
  for (const training::Part& part : data.layout.parts()) text += part.id.name() + bytes(part.sizes);
  const training::TrainerOptions& t = options.trainer;
  const std::array<double, 10> numbers = {t.gamma.value,
                                          t.learning_rate,
                                          static_cast<double>(t.gamma.scope),
                                          static_cast<double>(t.gamma.mode),
                                          static_cast<double>(t.batch),
                                          static_cast<double>(t.turns),
                                          static_cast<double>(options.weighing),
                                          options.max_lipschitz,
                                          static_cast<double>(t.layers),
                                          static_cast<double>(options.begins_within)};
  text += bytes(numbers);
  return files::sha256(text + std::to_string(t.seed) + "," + std::to_string(options.epochs));
}

constexpr const char* kSchema = "swarmcert/checkpoint/1";

files::Json as_json(const Vector& v) { return std::vector<float>(v.data(), v.data() + v.size()); }

Vector as_vector(const files::Json& json) {
  const std::vector<float> values = json.get<std::vector<float>>();
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

void write_checkpoint(const State& state, const std::string& key, const std::string& path) {
  files::Json epochs = files::Json::array();
  for (const Epoch& epoch : state.epochs) epochs.push_back({epoch.fit_rmse, epoch.select_rmse});
  const files::Json file = {{"schema", kSchema},           {"run", key},
                            {"epochs", std::move(epochs)}, {"trainer", as_json(state.trainer)},
                            {"best", as_json(state.best)}, {"shares", state.shares}};
  files::write_file(path, files::to_text(file), true);
}

State read_checkpoint(const std::string& key, const std::string& path) {
  const files::Json file = files::read_json(path, kSchema);
  const auto refuse = [&](const std::string& field, const std::string& what) {
    throw files::InputError({path, "", field, "", what, "start again with --force"});
  };
  State state;
  try {
    if (file.at("run") != key) refuse("run", "this checkpoint belongs to other flights, options or seed");
    state.trainer = as_vector(file.at("trainer"));
    state.best = as_vector(file.at("best"));
    state.shares = file.at("shares").get<std::vector<double>>();
    for (const files::Json& epoch : file.at("epochs"))
      state.epochs.push_back({epoch.at(0).get<double>(), epoch.at(1).get<double>()});
  } catch (const files::Json::exception& error) {
    refuse("", std::string("not a whole checkpoint: ") + error.what());
  }
  return state;
}

/// Samples per prediction batch: small enough for the cache, large enough for matrix products.
constexpr std::size_t kPredicted = 4096;

void set_targets(const training::Matrix& targets, Use use, LearningData& data) {
  for (const Eigen::Index s : data.indices(use))
    std::copy_n(targets.col(s).data(), targets.rows(), data.samples.target.begin() + s * targets.rows());
}

}  // namespace

int best_epoch(const std::vector<Epoch>& epochs) {
  int best = 0;
  for (std::size_t e = 1; e < epochs.size(); ++e) {
    if (epochs[e].select_rmse < epochs[best].select_rmse) best = static_cast<int>(e);
  }
  return best;
}

training::Matrix outputs_for(const LearningData& data, const Vector& theta, Use use) {
  training::Matrix result = training::Matrix::Zero(data.samples.outputs, data.samples.samples());
  const std::vector<Eigen::Index> samples = data.indices(use);
  for (std::size_t at = 0; at < samples.size(); at += kPredicted) {
    const auto count = static_cast<Eigen::Index>(std::min(kPredicted, samples.size() - at));
    const training::Matrix outputs =
        training::predict(data.layout, theta, data.samples, samples.data() + at, count);
    for (Eigen::Index i = 0; i < count; ++i)
      result.col(samples[at + static_cast<std::size_t>(i)]) = outputs.col(i);
  }
  return result;
}

Run run_training(const LearningData& data, const RunOptions& options) {
  const std::string key = fingerprint(data, options);
  const training::TrainerOptions& chosen = options.trainer;
  training::Trainer trainer(data.layout, data.samples, data.indices(Use::kFit),
                            training::initial_parameters(data.layout, chosen.seed), chosen);
  State state;
  state.best = trainer.theta();
  state.shares.assign(data.layout.parts().size(), 1.0);
  if (options.max_lipschitz > 0 && options.begins_within)
    state.shares = shares_of_product(options.max_lipschitz, chosen.layers, chosen.gamma, data.layout);
  if (options.resumes) {
    state = read_checkpoint(key, options.checkpoint);
    if (state.best.size() != data.layout.size() || state.shares.size() != data.layout.parts().size() ||
        state.epochs.empty())
      throw files::InputError(
          {options.checkpoint, "", "best", "", "not a whole checkpoint", "start again with --force"});
    trainer.restore(state.trainer);
  }
  Run run;
  for (int epoch = static_cast<int>(state.epochs.size()); epoch < options.epochs; ++epoch) {
    if (!state.epochs.empty() && epoch - best_epoch(state.epochs) > options.patience) break;
    if (options.cancelled != nullptr && *options.cancelled) {
      run.was_cancelled = true;
      break;
    }
    const double rate = chosen.learning_rate * 0.5 * (1 + std::cos(kPi * epoch / options.epochs));
    trainer.tighten(state.shares);
    trainer.weigh(weights_by(options.weighing, data, trainer.theta(), chosen.jobs));
    const double fit = std::sqrt(trainer.run_epoch(epoch, rate));
    if (!std::isfinite(fit) || !trainer.theta().allFinite())
      throw files::InputError({"", "", "--rate", fmt::format("{}", chosen.learning_rate),
                               fmt::format("the weights diverged in epoch {}", epoch + 1),
                               "give a smaller rate, or a smaller --gamma"});
    Vector candidate = trainer.theta();
    if (options.max_lipschitz > 0) {
      const Tightening asked = scale_to(options.max_lipschitz, data.layout, chosen.jobs, candidate);
      for (std::size_t p = 0; p < state.shares.size(); ++p)
        state.shares[p] = std::min(1.0, state.shares[p] * asked.shares[p]);
    }
    const double select = mean_rmse(data, candidate, Use::kSelect, chosen.jobs);
    state.epochs.push_back({fit, std::isnan(select) ? fit : select});
    if (best_epoch(state.epochs) == epoch) state.best = std::move(candidate);
    state.trainer = trainer.state();
    if (!options.checkpoint.empty()) write_checkpoint(state, key, options.checkpoint);
    if (options.progress) options.progress(epoch + 1, options.epochs, state.epochs.back().select_rmse);
  }
  run.seed = chosen.seed;
  run.theta = std::move(state.best);
  run.epochs = std::move(state.epochs);
  run.best_epoch = run.epochs.empty() ? 0 : best_epoch(run.epochs);
  project(data.layout, chosen.gamma, run.theta);
  if (options.max_lipschitz > 0)
    limit_joint_bounds(options.max_lipschitz, data.layout, chosen.jobs, run.theta);
  return run;
}

std::string checkpoint_of(const RunOptions& options, std::uint64_t seed) {
  if (options.checkpoint.empty() || seed == options.trainer.seed) return options.checkpoint;
  std::filesystem::path path = options.checkpoint;
  return path.replace_filename(path.stem().string() + "-" + std::to_string(seed) + path.extension().string())
      .string();
}

TaughtRun run_with_teachers(const LearningData& data, const RunOptions& options, int teachers) {
  TaughtRun taught;
  const bool selects = !data.indices(Use::kSelect).empty();
  training::Matrix said = training::Matrix::Zero(data.samples.outputs, data.samples.samples());
  LearningData of_teachers;
  for (int i = 1; i <= teachers + 1; ++i) {
    const bool is_last = i > teachers;
    RunOptions one = options;
    one.trainer.seed += is_last ? 0 : static_cast<std::uint64_t>(i);
    one.checkpoint = checkpoint_of(options, one.trainer.seed);
    one.resumes = options.resumes && (i == 1 || std::filesystem::exists(one.checkpoint));
    if (options.progress) {
      one.progress = [&options, i, teachers](int done, int total, double select_rmse) {
        options.progress((i - 1) * total + done, (teachers + 1) * total, select_rmse);
      };
    }
    if (is_last && teachers > 0) {
      of_teachers = data;
      set_targets(said / static_cast<float>(teachers), Use::kFit, of_teachers);
    }
    Run run = run_training(is_last && teachers > 0 ? of_teachers : data, one);
    if (run.was_cancelled) {
      taught.run = std::move(run);
      break;
    }
    if (!is_last) said += outputs_for(data, run.theta, Use::kFit);
    const Score score = {run.seed, run.best_epoch,
                         run.epochs[static_cast<std::size_t>(run.best_epoch)].select_rmse};
    const bool is_first = taught.scores.empty();
    taught.scores.push_back(score);
    if (is_first || (is_last && !selects) || score.select_rmse < taught.kept_score().select_rmse) {
      taught.run = std::move(run);
      taught.kept = taught.scores.size() - 1;
    }
  }
  return taught;
}

double rmse(const LearningData& data, const Vector& theta, Use use, int jobs) {
  const std::vector<Eigen::Index> samples = data.indices(use);
  if (samples.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::sqrt(training::mean_loss(data.layout, theta, data.samples, samples, jobs));
}

double rmse_of_nothing(const LearningData& data, Use use) {
  double squares = 0;
  const std::vector<Eigen::Index> samples = data.indices(use);
  for (const Eigen::Index s : samples) squares += data.samples.target_of(s).cast<double>().squaredNorm();
  return std::sqrt(squares / static_cast<double>(samples.size()));
}

}  // namespace swarmcert::learning

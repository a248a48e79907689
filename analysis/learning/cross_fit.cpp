#include "analysis/learning/cross_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "analysis/learning/lipschitz_limit.h"
#include "analysis/learning/mean_network.h"
#include "analysis/learning/projection.h"
#include "nn/base/input_error.h"

namespace swarmcert::learning {
namespace {

/// Returns the fold of each flight other than test flights, assigned in turn in the order of the tracks.
std::map<std::string, int> folds_of_flights(const LearningData& data, int folds) {
  std::map<std::string, int> result;
  for (const TrackSamples& track : data.tracks) {
    if (track.use != Use::kTest) result.emplace(track.flight, static_cast<int>(result.size()) % folds);
  }
  if (static_cast<int>(result.size()) < folds)
    throw files::InputError({"", "", "--folds", fmt::format("{}", folds),
                             fmt::format("{} flights are too few: each fold requires one", result.size()),
                             "name more flights, or fewer folds"});
  return result;
}

/// Moves fold k from the fitted to the selecting flights and sets the weight of its samples to 1; none for k < 0.
void leave_out(const std::map<std::string, int>& folds, int k, LearningData& data) {
  for (TrackSamples& track : data.tracks) {
    if (track.use == Use::kTest) continue;
    track.use = folds.at(track.flight) == k ? Use::kSelect : Use::kFit;
    std::fill(data.samples.weight.begin() + track.begin, data.samples.weight.begin() + track.end, 1.0f);
  }
  balance(data);
}

/// Mean errors over the networks for each epoch that all of them ran.
std::vector<Epoch> mean_epochs(const std::vector<Run>& runs) {
  std::vector<Epoch> mean = runs.front().epochs;
  for (const Run& run : runs) mean.resize(std::min(mean.size(), run.epochs.size()));
  for (std::size_t e = 0; e < mean.size(); ++e) {
    mean[e] = {};
    for (const Run& run : runs) {
      mean[e].fit_rmse += run.epochs[e].fit_rmse / static_cast<double>(runs.size());
      mean[e].select_rmse += run.epochs[e].select_rmse / static_cast<double>(runs.size());
    }
  }
  return mean;
}

/// Returns the mean of the networks, which keeps the limits that they keep.
Run mean_run(const std::vector<Run>& runs, const RunOptions& options, LearningData& data) {
  std::vector<training::Vector> members;
  for (const Run& run : runs) members.push_back(run.theta);
  Run mean;
  mean.seed = options.trainer.seed;
  mean.theta = mean_network(data.layout, members);
  data.layout = layout_of_mean(data.layout, static_cast<int>(members.size()));
  project(data.layout, options.trainer.gamma, mean.theta);
  if (options.max_lipschitz > 0)
    limit_joint_bounds(options.max_lipschitz, data.layout, options.trainer.jobs, mean.theta);
  mean.epochs = mean_epochs(runs);
  mean.best_epoch = best_epoch(mean.epochs);
  return mean;
}

}  // namespace

CrossFit cross_fit(const RunOptions& options, int folds, LearningData& data) {
  if (folds < 2) throw std::invalid_argument("cross_fit: needs at least two folds");
  const std::map<std::string, int> of_flights = folds_of_flights(data, folds);
  CrossFit result;
  result.unseen = training::Matrix::Zero(data.samples.outputs, data.samples.samples());
  std::vector<Run> runs;
  for (int k = 0; k < folds; ++k) {
    leave_out(of_flights, k, data);
    RunOptions one = options;
    one.trainer.seed += static_cast<std::uint64_t>(k);
    one.checkpoint = checkpoint_of(options, one.trainer.seed);
    one.resumes = options.resumes && (k == 0 || std::filesystem::exists(one.checkpoint));
    if (options.progress) {
      one.progress = [&options, k, folds](int done, int total, double select_rmse) {
        options.progress(k * total + done, folds * total, select_rmse);
      };
    }
    runs.push_back(run_training(data, one));
    const Run& run = runs.back();
    if (run.was_cancelled) {
      result.run = run;
      return result;
    }
    result.members.push_back(
        {run.seed, run.best_epoch, run.epochs[static_cast<std::size_t>(run.best_epoch)].select_rmse});
    result.unseen += outputs_for(data, run.theta, Use::kSelect);
  }
  leave_out(of_flights, -1, data);
  result.run = mean_run(runs, options, data);
  return result;
}

}  // namespace swarmcert::learning

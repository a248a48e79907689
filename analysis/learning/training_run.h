/// @file A training run: epochs, early stopping, checkpoints.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "analysis/learning/weighing.h"
#include "nn/training/trainer.h"

namespace swarmcert::learning {

struct RunOptions {
  training::TrainerOptions trainer;
  Weighing weighing = Weighing::kErrors;
  double max_lipschitz = 0;  ///< limit that the joint bounds are proved to keep; 0: only gamma
  /// If true, the first epoch uses the limits of shares_of_product(), which later epochs relax or tighten; otherwise
  /// it uses gamma's limits, which are reduced epoch by epoch.
  bool begins_within = true;
  int epochs = 40;
  int patience = 10;  ///< the run ends after this many epochs without a better score on the selecting flights
  std::string checkpoint;                        ///< written after every epoch; empty: none
  bool resumes = false;                          ///< continue from the checkpoint
  const std::atomic<bool>* cancelled = nullptr;  ///< ends the run after the current epoch
  std::function<void(int done, int total, double select_rmse)> progress;
};

/// Root mean square errors in the unit of the targets. fit_rmse: on the fitted flights, accumulated during the epoch
/// with the sample weights. select_rmse: on the selecting flights, mean over groups.
struct Epoch {
  double fit_rmse = 0, select_rmse = 0;
};

/// Returns the earliest epoch with the least error on the selecting flights; 0 if there are none.
int best_epoch(const std::vector<Epoch>& epochs);

struct Run {
  std::uint64_t seed = 0;
  training::Vector theta;  ///< weights of the best epoch by the selecting flights, projected onto gamma
  int best_epoch = 0;
  std::vector<Epoch> epochs;
  bool was_cancelled = false;  ///< the checkpoint holds the state from which to resume
};

/// Trains a network. The learning rate decays from its stated value to zero along half a cosine over `epochs`. The
/// same data, options and seed give the same bits, regardless of the number of threads and of how often the run was
/// resumed. With max_lipschitz, epochs are compared after scaling their networks to the limit, and layers whose
/// bounds exceed it are clipped below gamma in the next epoch.
/// @throws files::InputError if the checkpoint cannot be read, or belongs to other networks, data or options.
Run run_training(const LearningData& data, const RunOptions& options);

/// Returns [outputs x samples] the outputs of theta for the samples of `use`, in the unit of the targets; 0 for other
/// samples.
training::Matrix outputs_for(const LearningData& data, const training::Vector& theta, Use use);

struct Score {
  std::uint64_t seed;
  int best_epoch;
  double select_rmse;
};

struct TaughtRun {
  Run run;                    ///< the run preferred by the selecting flights, or the cancelled run
  std::vector<Score> scores;  ///< of the teachers, then of the network they taught
  std::size_t kept = 0;       ///< index of `run` in `scores`
  const Score& kept_score() const { return scores[kept]; }
};

/// Returns the checkpoint file for `seed` in a run with teachers.
std::string checkpoint_of(const RunOptions& options, std::uint64_t seed);

/// Trains `teachers` networks, with the seeds after options.trainer.seed, and then a network that is fitted to the
/// mean of their outputs on the samples to fit instead of the recorded targets (distillation: Hinton et al. 2015). On
/// recorded flights the errors of networks differ by several percent between seeds. These differences average out,
/// and the taught network keeps gamma and max_lipschitz like any other. Of all networks, the one preferred by the
/// recorded selecting flights is kept; if no flights select, the taught one. Without teachers this is run_training().
/// A cancelled run is returned at once, as it is.
TaughtRun run_with_teachers(const LearningData& data, const RunOptions& options, int teachers);

/// Returns the RMSE, in the unit of the targets, of theta on the samples of `use`; for kFit weighted by scenario; NaN
/// if there are no samples.
double rmse(const LearningData& data, const training::Vector& theta, Use use, int jobs);
/// The same for a zero prediction: the root mean square of the targets.
double rmse_of_nothing(const LearningData& data, Use use);

}  // namespace swarmcert::learning

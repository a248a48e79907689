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
  double max_lipschitz = 0;  ///< joint bounds are proved to keep it; 0: no limit but gamma
  /// The first epoch has the limits of shares_of_product(), which the next ones let out or tighten; else gamma's, from
  /// which the layers come down epoch by epoch.
  bool begins_within = true;
  int epochs = 40;
  int patience = 10;       ///< epochs without a better score on the selecting flights before the run ends
  std::string checkpoint;  ///< file that is written after every epoch; empty: none
  bool resumes = false;    ///< begin with what the checkpoint holds
  const std::atomic<bool>* cancelled = nullptr;  ///< ends the run after the epoch in which it is set
  std::function<void(int done, int total, double select_rmse)> progress;
};

/// Root mean square errors in the unit of the targets: of the flights that are fitted, met during the epoch and
/// weighted; of those that select, the mean over groups.
struct Epoch {
  double fit_rmse = 0, select_rmse = 0;
};

/// The earliest epoch with the least error on the selecting flights; 0 without any.
int best_epoch(const std::vector<Epoch>& epochs);

struct Run {
  std::uint64_t seed = 0;
  training::Vector
      theta;  ///< of the epoch with the best score on the selecting flights, projected onto gamma
  int best_epoch = 0;
  std::vector<Epoch> epochs;
  bool was_cancelled = false;  ///< the checkpoint holds the rest
};

/// Trains. The learning rate falls from the stated one to zero along half a cosine over `epochs`. The same data,
/// options and seed give the same bits, whatever the number of threads and however often the run was taken up again.
/// With max_lipschitz, epochs compete with their networks scaled to the limit, and layers whose bounds exceed it are
/// clipped at less than gamma in the next epoch.
/// @throws files::InputError if the checkpoint cannot be read, or is of other networks, data or options.
Run run_training(const LearningData& data, const RunOptions& options);

/// [outputs x samples] What theta says of the samples of `use`, in the unit of the targets; 0 for the others.
training::Matrix outputs_for(const LearningData& data, const training::Vector& theta, Use use);

struct Score {
  std::uint64_t seed;
  int best_epoch;
  double select_rmse;
};

struct TaughtRun {
  Run run;  ///< of those below the one that the selecting flights prefer, or the cancelled one
  std::vector<Score> scores;  ///< of the teachers, and last of the one that they taught
  std::size_t kept = 0;       ///< which of `scores` is run's
  const Score& kept_score() const { return scores[kept]; }
};

/// File that keeps what `seed` has reached, of a run with teachers.
std::string checkpoint_of(const RunOptions& options, std::uint64_t seed);

/// Trains `teachers` networks, with the seeds after options.trainer.seed, and then one that is fitted to the mean of
/// what they say of the samples to fit, in place of the recorded targets (distillation: Hinton et al. 2015). Recorded
/// flights leave networks of several seeds with errors that differ by several percent; those average out, and the one
/// network that is taught keeps gamma and max_lipschitz like any other. Of all of them the one is kept that the
/// selecting flights, as recorded, prefer; where no flights select, the one that was taught. Without teachers it is
/// run_training(). A run that is cancelled is returned at once, as it is.
TaughtRun run_with_teachers(const LearningData& data, const RunOptions& options, int teachers);

/// RMSE, in the unit of the targets, of theta on the samples of `use`, of kFit weighted by scenario; NaN where there
/// are none.
double rmse(const LearningData& data, const training::Vector& theta, Use use, int jobs);
/// The same of predicting nothing: the root mean square of the targets.
double rmse_of_nothing(const LearningData& data, Use use);

}  // namespace swarmcert::learning

/// @file Cross-fitting: training without separate selecting flights. Each of several networks leaves out some of the
/// flights.
#pragma once

#include <vector>

#include "analysis/learning/training_run.h"

namespace swarmcert::learning {

struct CrossFit {
  /// theta: the mean of the networks, with layout data.layout; epochs: the mean over the networks of the epochs that
  /// all of them ran, and the best of these. If a network was cancelled, its run instead.
  Run run;
  std::vector<Score> members;  ///< each scored on the flights left out of its fit
  /// [outputs x samples] For every fitted sample, the output of the network that left its flight out.
  training::Matrix unseen;
};

/// Cross-fitting (Breiman 1996, Chernozhukov et al. 2018): the flights that are not test flights are assigned in turn
/// to `folds` folds. Network k, with seed options.trainer.seed + k, is fitted to all folds but fold k, which selects
/// its epoch.
/// The result is the mean of the networks as one deep set (mean_network()). Errors in which the networks differ
/// average out, every flight is fitted, and yet `unseen` shows for every flight how well flights like it are
/// predicted. That estimate is slightly optimistic, since the flight chose the epoch, and pessimistic, since it is
/// the output of one network rather than of the mean; output_support() corrects for the latter. gamma and
/// max_lipschitz are proved for the mean. On return, data.layout is that of the mean, and all tracks except test
/// tracks have Use::kFit.
/// @throws files::InputError as run_training(), and if there are fewer flights than folds; std::invalid_argument if
///     folds < 2.
CrossFit cross_fit(const RunOptions& options, int folds, LearningData& data);

}  // namespace swarmcert::learning

/// @file Training that needs no flights of its own to select: each of several networks leaves out some of the flights.
#pragma once

#include <vector>

#include "analysis/learning/training_run.h"

namespace swarmcert::learning {

struct CrossFit {
  /// theta: the mean of the networks, of data.layout; epochs: mean over the networks, of the epochs that all of them
  /// ran, and the best of these; or the network that was cancelled.
  Run run;
  std::vector<Score> members;  ///< each on the flights that it left out
  /// [outputs x samples] Of every sample that is fitted, what the network says that left its flight out.
  training::Matrix unseen;
};

/// Cross-fitting (Breiman 1996, Chernozhukov et al. 2018): the flights that do not test are assigned in turn to `folds`
/// folds. Network k, of seed options.trainer.seed + k, is fitted to all but fold k, which selects its epoch.
/// The result is the mean of the networks as one deep set (mean_network()), so that errors in which they differ average
/// out, every flight is fitted, and yet `unseen` says of every flight how well flights like it are predicted: slightly
/// too well, since the flight chose the epoch, and too badly, since it is what one network says and not their mean:
/// output_support() corrects for that. gamma and max_lipschitz are proved of the mean. Afterwards data.layout is that
/// of the mean, and tracks that do not test have Use::kFit.
/// @throws files::InputError as run_training(), and where there are fewer flights than folds;
///   std::invalid_argument if folds < 2.
CrossFit cross_fit(const RunOptions& options, int folds, LearningData& data);

}  // namespace swarmcert::learning

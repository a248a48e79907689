/// @file Weight of each group of tracks (TrackSamples::group()) in training, and its remaining error.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/learning/dataset.h"

namespace swarmcert::learning {

/// Which quantity is equal for all groups.
enum class Weighing {
  kGroups,  ///< the total weight: large vehicles dominate because their forces are ten times as large
  kErrors,  ///< the total weight divided by its present mean squared error: minimises the mean logarithm of the error
};

/// Returns the mean squared error per group over every `stride`-th sample of `use`.
std::map<std::string, double> errors_by_group(const LearningData& data, const training::Vector& theta,
                                              Use use, int stride, int jobs);

/// Returns the mean over groups of the root mean square error, in the unit of the targets; NaN if `use` has no sample.
double mean_rmse(const LearningData& data, const training::Vector& theta, Use use, int jobs);

/// Returns the weights of all samples for the next epoch. With kErrors, the loss with these weights has at theta the
/// gradient of the sum over groups of log(mean squared error), i.e. maximum likelihood for noise with a separate
/// variance per group. The weights sum to the number of samples.
std::vector<float> weights_by(Weighing weighing, const LearningData& data, const training::Vector& theta,
                              int jobs);

}  // namespace swarmcert::learning

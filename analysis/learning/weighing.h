/// @file Weight of each group of tracks (TrackSamples::group()) in training, and its remaining error.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/learning/dataset.h"

namespace swarmcert::learning {

/// What makes two groups count the same.
enum class Weighing {
  kGroups,  ///< the same total weight: large vehicles, whose forces are ten times as large, decide
  kErrors,  ///< the same total weight over its mean squared error so far: what falls is the mean logarithm
};

/// Mean squared error per group, over every `stride`-th sample of `use`.
std::map<std::string, double> errors_by_group(const LearningData& data, const training::Vector& theta,
                                              Use use, int stride, int jobs);

/// Mean over groups of the root mean square error, in the unit of the targets; NaN where `use` has no sample.
double mean_rmse(const LearningData& data, const training::Vector& theta, Use use, int jobs);

/// Weights of all samples for the next epoch. kErrors: sum over groups of log(mean squared error) has, at theta,
/// the gradient of the loss with these weights (maximum likelihood of noise whose variance each group has of its
/// own). They sum to the number of samples.
std::vector<float> weights_by(Weighing weighing, const LearningData& data, const training::Vector& theta,
                              int jobs);

}  // namespace swarmcert::learning

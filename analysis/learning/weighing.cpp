#include "analysis/learning/weighing.h"

#include <cmath>
#include <limits>

#include "nn/training/trainer.h"

namespace swarmcert::learning {
namespace {

using Eigen::Index;

/// Neighbouring records have nearly the same error, and weights need only its magnitude.
constexpr int kStride = 8;

}  // namespace

std::map<std::string, double> errors_by_group(const LearningData& data, const training::Vector& theta,
                                              Use use, int stride, int jobs) {
  std::map<std::string, std::vector<Index>> members;
  for (const TrackSamples& track : data.tracks) {
    if (track.use != use) continue;
    for (Index s = track.begin; s < track.end; s += stride) members[track.group()].push_back(s);
  }
  std::map<std::string, double> errors;
  for (const auto& [group, samples] : members)
    errors[group] = training::mean_loss(data.layout, theta, data.samples, samples, jobs);
  return errors;
}

double mean_rmse(const LearningData& data, const training::Vector& theta, Use use, int jobs) {
  const std::map<std::string, double> errors = errors_by_group(data, theta, use, 1, jobs);
  if (errors.empty()) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0;
  for (const auto& [group, error] : errors) sum += std::sqrt(error);
  return sum / static_cast<double>(errors.size());
}

std::vector<float> weights_by(Weighing weighing, const LearningData& data, const training::Vector& theta,
                              int jobs) {
  std::vector<float> weights = data.samples.weight;  // equal total weight per group
  if (weighing == Weighing::kGroups) return weights;
  const std::map<std::string, double> errors = errors_by_group(data, theta, Use::kFit, kStride, jobs);
  double inverse = 0;
  for (const auto& [group, error] : errors) inverse += 1 / error;
  for (const TrackSamples& track : data.tracks) {
    if (track.use != Use::kFit) continue;
    const double share = static_cast<double>(errors.size()) / (inverse * errors.at(track.group()));
    for (Index s = track.begin; s < track.end; ++s) weights[s] *= static_cast<float>(share);
  }
  return weights;
}

}  // namespace swarmcert::learning

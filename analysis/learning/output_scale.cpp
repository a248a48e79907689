#include "analysis/learning/output_scale.h"

#include <algorithm>

#include "nn/training/deep_set_loss.h"
#include "nn/weights/function_names.h"

namespace swarmcert::learning {
namespace {

/// Rounding of scaled weights to float32 must not lead across the limit.
constexpr double kBelowTheLimit = 1 - 1e-4;

/// Sums over the samples of one composition, y the target and f the network's output.
struct Products {
  double yf = 0, ff = 0;
  double samples = 0;
};

std::map<std::string, Products> products_of(const LearningData& data, const training::Matrix& outputs,
                                            Use use) {
  std::map<std::string, Products> result;
  for (const TrackSamples& track : data.tracks) {
    if (track.use != use) continue;
    Products& sum = result[track.composition];
    for (Eigen::Index s = track.begin; s < track.end; ++s) {
      const Eigen::VectorXd f = outputs.col(s).cast<double>();
      sum.yf += data.samples.target_of(s).cast<double>().dot(f);
      sum.ff += f.squaredNorm();
    }
    sum.samples += static_cast<double>(track.end - track.begin);
  }
  return result;
}

std::string kind_of(const std::string& composition) { return composition.substr(composition.rfind('>') + 1); }

}  // namespace

std::map<std::string, double> output_scales(const LearningData& data, const training::Matrix& outputs,
                                            Use use) {
  struct Sums {
    double yf = 0, ff = 0, limit = 1;
  };
  std::map<std::string, Sums> kinds;
  for (const auto& [composition, products] : products_of(data, outputs, use)) {
    if (!(products.ff > 0)) continue;
    Sums& kind = kinds[kind_of(composition)];
    kind.yf += products.yf / products.samples;
    kind.ff += products.ff / products.samples;
    kind.limit = std::min(kind.limit, kBelowTheLimit * 2 * products.yf / products.ff);
  }
  std::map<std::string, double> result;
  for (const auto& [kind, sums] : kinds)
    result[kind] = std::clamp(sums.yf / sums.ff, 0.0, std::max(0.0, sums.limit));
  return result;
}

void scale_outputs(const LearningData& data, const std::map<std::string, double>& scales,
                   training::Matrix& outputs) {
  for (const TrackSamples& track : data.tracks) {
    const auto scale = scales.find(kind_of(track.composition));
    if (scale != scales.end())
      outputs.middleCols(track.begin, track.end - track.begin) *= static_cast<float>(scale->second);
  }
}

void scale_outputs(const training::Layout& layout, const std::map<std::string, double>& scales,
                   training::Vector& theta) {
  for (const auto& [kind, scale] : scales) {
    const int part = layout.find(files::rho_name(kind));
    if (part < 0) continue;
    const int last = layout.parts()[static_cast<std::size_t>(part)].layers() - 1;
    layout.weights(theta, part, last) *= static_cast<float>(scale);
    layout.biases(theta, part, last) *= static_cast<float>(scale);
  }
}

}  // namespace swarmcert::learning

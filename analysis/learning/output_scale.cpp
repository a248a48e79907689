#include "analysis/learning/output_scale.h"

#include <algorithm>
#include <cmath>

#include "nn/training/deep_set_loss.h"
#include "nn/weights/function_id.h"

namespace swarmcert::learning {
namespace {

/// Margin so that rounding of scaled weights to float32 does not cross the limit.
constexpr double kBelowTheLimit = 1 - 1e-4;

/// Sums over the samples of one composition; y is the target, f the output of the network.
struct Products {
  double yy = 0, yf = 0, ff = 0;
  double samples = 0;

  /// f helps at scales below this.
  double limit() const { return kBelowTheLimit * 2 * yf / ff; }
  SupportedErrors errors(double scale) const {
    const double left = yy - 2 * scale * yf + scale * scale * ff;
    return {std::sqrt(std::max(left, 0.0) / samples), std::sqrt(yy / samples), samples};
  }
};

std::map<std::string, Products> products_of(const LearningData& data, const training::Matrix& unseen,
                                            const training::Matrix& whole, Use use) {
  std::map<std::string, Products> result;
  for (const TrackSamples& track : data.tracks) {
    if (track.use != use) continue;
    Products& sum = result[track.composition];
    for (Eigen::Index s = track.begin; s < track.end; ++s) {
      const Eigen::VectorXd y = data.samples.target_of(s).cast<double>();
      sum.yy += y.squaredNorm();
      sum.yf += y.dot(unseen.col(s).cast<double>());
      sum.ff += whole.col(s).cast<double>().squaredNorm();
    }
    sum.samples += static_cast<double>(track.end - track.begin);
  }
  return result;
}

std::string kind_of(const std::string& composition) { return composition.substr(composition.rfind('>') + 1); }

/// Minimises sum_c min(0, mean |y - s f|^2 - mean |y|^2) over s. At any s, f helps in the compositions with the
/// largest limits, so each such set is tried at its best scale.
double best_scale(std::vector<Products> compositions) {
  std::sort(compositions.begin(), compositions.end(),
            [](const Products& a, const Products& b) { return a.limit() > b.limit(); });
  double best = 0, least = 0, yf = 0, ff = 0;
  for (const Products& one : compositions) {
    if (!(one.limit() > 0)) break;
    yf += one.yf / one.samples;
    ff += one.ff / one.samples;
    const double scale = std::min({yf / ff, one.limit(), 1.0});
    const double change = scale * (scale * ff - 2 * yf);
    if (change < least) best = scale, least = change;
  }
  return best;
}

}  // namespace

std::vector<std::string> OutputSupport::silent_names() const {
  std::vector<std::string> names;
  for (const auto& [composition, errors] : silent) names.push_back(composition);
  return names;
}

SupportedErrors OutputSupport::all() const {
  double network = 0, nothing = 0, samples = 0;
  for (const auto& [composition, errors] : left) {
    network += errors.samples * errors.network * errors.network;
    nothing += errors.samples * errors.nothing * errors.nothing;
    samples += errors.samples;
  }
  return {std::sqrt(network / samples), std::sqrt(nothing / samples), samples};
}

OutputSupport output_support(const LearningData& data, const training::Matrix& unseen,
                             const training::Matrix& whole, Use use, Support may) {
  const std::map<std::string, Products> all = products_of(data, unseen, whole, use);
  OutputSupport support;
  if (may == Support::kScaleAndSilence) {
    std::map<std::string, std::vector<Products>> kinds;
    for (const auto& [composition, products] : all)
      if (products.ff > 0) kinds[kind_of(composition)].push_back(products);
    for (const auto& [kind, compositions] : kinds) support.scales[kind] = best_scale(compositions);
  }
  for (const auto& [composition, products] : all) {
    const auto found = support.scales.find(kind_of(composition));
    const double scale = found == support.scales.end() ? 1 : found->second;
    // A scale of 0 never helps, unless the output is 0 anyway.
    const bool helps = products.ff == 0 || (scale > 0 && scale <= products.limit());
    const bool speaks = helps || may == Support::kAsTrained;
    support.left[composition] = products.errors(speaks ? scale : 0);
    if (!speaks) support.silent[composition] = products.errors(1);
  }
  return support;
}

void silence(const LearningData& data, const OutputSupport& support, training::Matrix& outputs) {
  for (const TrackSamples& track : data.tracks) {
    if (support.silent.count(track.composition) == 1)
      outputs.middleCols(track.begin, track.end - track.begin).setZero();
  }
}

void scale_outputs(const training::Layout& layout, const std::map<std::string, double>& scales,
                   training::Vector& theta) {
  for (const auto& [kind, scale] : scales) {
    const int part = layout.find(files::FunctionId::rho(kind));
    if (part < 0) continue;
    const int last = layout.parts()[static_cast<std::size_t>(part)].layers() - 1;
    layout.weights(theta, part, last) *= static_cast<float>(scale);
    layout.biases(theta, part, last) *= static_cast<float>(scale);
  }
}

}  // namespace swarmcert::learning

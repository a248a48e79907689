/// @file Keeps the spectral norm of each layer at its limit during training.
#pragma once

#include <vector>

#include "nn/training/layout.h"
#include "nn/weights/network.h"

namespace swarmcert::training {

/// Returns the limit on one layer's spectral norm that `gamma` implies for a network of `layers` layers: gamma itself
/// if it applies per layer, gamma^(1 / layers) if it bounds the whole network (paper, section III-B).
double layer_limit(const files::GammaStatement& gamma, int layers);

/// Rescales the layers after each optimiser step:
///   mode clip:  W <- W min(1, limit / |W|),   used to train the published networks;
///   mode equal: W <- W limit / |W|,           as in the paper, section III-B.
/// The spectral norm |W| is estimated by power iteration with a warm start from the previous step, so the estimate
/// approaches the norm from below as the weights settle. The stored weights are projected again, using a proven norm.
class SpectralNormalization {
 public:
  SpectralNormalization(const Layout& layout, const files::GammaStatement& gamma, const Vector& theta);

  /// Performs one power iteration per layer, then rescales the layers.
  void apply(Vector& theta);

  /// Sets the limit of every layer of each part to its share, in (0, 1], of the limit that gamma implies.
  /// @param shares one per part.
  void tighten(const std::vector<double>& shares) { shares_ = shares; }

  /// Returns the estimated spectral norms, per part and layer.
  const std::vector<std::vector<double>>& norms() const { return norms_; }

 private:
  void iterate(const Vector& theta, int part, int layer);

  const Layout* layout_;  ///< never null; a pointer makes the class assignable
  files::GammaStatement gamma_;
  std::vector<std::vector<Vector>> right_;  ///< estimates of the leading right singular vectors
  std::vector<std::vector<double>> norms_;
  std::vector<double> shares_;
};

}  // namespace swarmcert::training

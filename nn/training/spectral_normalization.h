/// @file Keeps the spectral norm of each layer at its limit during training.
#pragma once

#include <vector>

#include "nn/training/layout.h"
#include "nn/weights/network.h"

namespace swarmcert::training {

/// The limit of one layer's spectral norm that `gamma` asks of a network of `layers` layers: gamma itself per layer,
/// gamma^(1 / layers) where it bounds the whole network (paper, section III-B).
double layer_limit(const files::GammaStatement& gamma, int layers);

/// Rescales the layers after each step of the optimiser:
///   mode clip:  W <- W min(1, limit / |W|),   what the published networks were trained with;
///   mode equal: W <- W limit / |W|,           the paper, section III-B.
/// |W| is estimated by power iteration that starts where the last one ended, so it approaches the norm from below as
/// the weights settle. The stored weights are projected again, against a norm that is proved.
class SpectralNormalization {
 public:
  SpectralNormalization(const Layout& layout, const files::GammaStatement& gamma, const Vector& theta);

  /// One power iteration per layer, then the rescaling.
  void apply(Vector& theta);

  /// From now on the limit of every layer of a part is its share of gamma's, in (0, 1]. @param shares one per part.
  void tighten(const std::vector<double>& shares) { shares_ = shares; }

  /// Estimated norms, per part and layer.
  const std::vector<std::vector<double>>& norms() const { return norms_; }

 private:
  void iterate(const Vector& theta, int part, int layer);

  const Layout* layout_;  ///< never null; a pointer so that values can be assigned
  files::GammaStatement gamma_;
  std::vector<std::vector<Vector>> right_;  ///< estimates of the leading right singular vectors
  std::vector<std::vector<double>> norms_;
  std::vector<double> shares_;
};

}  // namespace swarmcert::training

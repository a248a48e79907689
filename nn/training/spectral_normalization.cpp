#include "nn/training/spectral_normalization.h"

#include <cmath>

namespace swarmcert::training {
namespace {

constexpr int kFirstIterations = 30;

}  // namespace

double layer_limit(const files::GammaStatement& gamma, int layers) {
  return gamma.scope == files::GammaStatement::Scope::kLayer ? gamma.value
                                                             : std::pow(gamma.value, 1.0 / layers);
}

SpectralNormalization::SpectralNormalization(const Layout& layout, const files::GammaStatement& gamma,
                                             const Vector& theta)
    : layout_(&layout), gamma_(gamma), shares_(layout.parts().size(), 1.0) {
  for (std::size_t p = 0; p < layout.parts().size(); ++p) {
    const int part = static_cast<int>(p);
    right_.emplace_back();
    norms_.emplace_back(static_cast<std::size_t>(layout.parts()[p].layers()), 0.0);
    for (int k = 0; k < layout.parts()[p].layers(); ++k) {
      const int inputs = layout.parts()[p].sizes[k];
      right_.back().push_back(Vector::LinSpaced(inputs, 1.0f, 1.7f).normalized());
      for (int i = 0; i < kFirstIterations; ++i) iterate(theta, part, k);
    }
  }
}

void SpectralNormalization::iterate(const Vector& theta, int part, int layer) {
  const Eigen::Map<const Matrix> w = layout_->weights(theta, part, layer);
  Vector& right = right_[part][layer];
  const Vector image = w * right;
  norms_[part][layer] = static_cast<double>(image.norm());
  const Vector next = w.transpose() * image;
  const float length = next.norm();
  if (length > 0) right = next / length;  // otherwise the layer is zero and any direction is valid
}

void SpectralNormalization::apply(Vector& theta) {
  for (std::size_t p = 0; p < right_.size(); ++p) {
    const int part = static_cast<int>(p);
    const int layers = layout_->parts()[p].layers();
    const double limit = shares_[p] * layer_limit(gamma_, layers);
    for (int k = 0; k < layers; ++k) {
      iterate(theta, part, k);
      double& norm = norms_[p][k];
      const bool rescales = gamma_.mode == files::GammaStatement::Mode::kEqual ? norm > 0 : norm > limit;
      if (!rescales) continue;
      layout_->weights(theta, part, k) *= static_cast<float>(limit / norm);
      norm = limit;
    }
  }
}

}  // namespace swarmcert::training

#include "analysis/learning/projection.h"

#include <stdexcept>

#include "lipschitz/certify.h"
#include "nn/training/spectral_normalization.h"

namespace swarmcert::learning {
namespace {

/// Rounding a 40 x 40 layer to float32 moves its norm by up to 40 * 2^-24 of it: one or two tries suffice.
constexpr int kMostTries = 40;
constexpr double kHeadroom = 0x1p-24;

bool is_proved(const files::GammaStatement& gamma, const lipschitz::SpectralNorm& norm, int layers) {
  return lipschitz::respects_gamma(gamma, norm.norm, static_cast<std::size_t>(layers)) ==
         lipschitz::Verdict::kProved;
}

}  // namespace

void project(const training::Layout& layout, const files::GammaStatement& gamma, training::Vector& theta) {
  for (std::size_t p = 0; p < layout.parts().size(); ++p) {
    const int part = static_cast<int>(p);
    const int layers = layout.parts()[p].layers();
    const double limit = training::layer_limit(gamma, layers);
    for (int k = 0; k < layers; ++k) {
      bool proved = false;
      for (int tries = 0; tries < kMostTries && !proved; ++tries) {
        const files::Layer layer = layout.stored(theta, part).layers[static_cast<std::size_t>(k)];
        const lipschitz::SpectralNorm norm = lipschitz::spectral_norm(layer, limit);
        proved = is_proved(gamma, norm, layers);
        const double upper = norm.norm.upper.value();
        if (!proved && upper > 0)
          layout.weights(theta, part, k) *= static_cast<float>(limit / upper * (1 - kHeadroom * (1 + tries)));
      }
      if (!proved) throw std::runtime_error(layout.parts()[p].name + ": no proof that a layer keeps gamma");
    }
  }
}

}  // namespace swarmcert::learning

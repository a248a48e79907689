#include "analysis/learning/projection.h"

#include <stdexcept>
#include <vector>

#include "lipschitz/certify.h"
#include "nn/training/spectral_normalization.h"

namespace swarmcert::learning {
namespace {

/// Rounding a 40 x 40 layer to float32 changes its norm by at most 40 * 2^-24 relatively, so one or two tries suffice.
constexpr int kMostTries = 40;
constexpr double kHeadroom = 0x1p-24;

/// Scales the layers of the part that are not proved to keep gamma. Returns true once all are proved.
bool improve(const training::Layout& layout, const files::GammaStatement& gamma, int part, int tries,
             training::Vector& theta) {
  const int layers = layout.parts()[static_cast<std::size_t>(part)].layers();
  const double limit = training::layer_limit(gamma, layers);
  std::vector<lipschitz::Enclosure> norms;
  for (const files::Layer& layer : layout.stored(theta, part).layers)
    norms.push_back(lipschitz::spectral_norm(layer, limit).norm);
  const std::vector<lipschitz::Verdict> verdicts = lipschitz::respects_gamma(gamma, norms);
  bool all_proved = true;
  for (int k = 0; k < layers; ++k) {
    if (verdicts[k] == lipschitz::Verdict::kProved) continue;
    all_proved = false;
    const double goal = limit * (1 - kHeadroom * (1 + tries));
    const double upper = norms[k].upper.value();
    const bool rescales = gamma.mode == files::GammaStatement::Mode::kEqual ? upper > 0 : upper > goal;
    if (rescales) layout.weights(theta, part, k) *= static_cast<float>(goal / upper);
  }
  return all_proved;
}

}  // namespace

void project(const training::Layout& layout, const files::GammaStatement& gamma, training::Vector& theta) {
  for (std::size_t p = 0; p < layout.parts().size(); ++p) {
    int tries = 0;
    while (!improve(layout, gamma, static_cast<int>(p), tries, theta)) {
      if (++tries == kMostTries)
        throw std::runtime_error(layout.parts()[p].id.name() + ": its limit gamma could not be proved");
    }
  }
}

}  // namespace swarmcert::learning

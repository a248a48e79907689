#include "analysis/learning/lipschitz_limit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/sdp_bound.h"
#include "lipschitz/upper/spectral_norm.h"
#include "nn/base/parallel.h"
#include "nn/training/spectral_normalization.h"
#include "nn/weights/function_id.h"
#include "nn/weights/network.h"

namespace swarmcert::learning {
namespace {

/// Rounding the scaled weights to float32 changes the bound by about 2^-24 of it.
constexpr double kScalingHeadroom = 0x1p-20;
constexpr int kMostScalings = 8;

lipschitz::UpperBound product_of_norms(const files::Weights& phi, const files::Weights& rho) {
  std::vector<lipschitz::UpperBound> norms;
  for (const files::Weights* const weights : {&phi, &rho}) {
    for (const files::Layer& layer : weights->layers)
      norms.push_back(lipschitz::spectral_norm(layer).norm.upper);
  }
  return lipschitz::product_up(norms);
}

}  // namespace

std::vector<JointBound> joint_bounds(const training::Layout& layout, const training::Vector& theta,
                                     int jobs) {
  files::Network network;
  std::vector<JointBound> bounds;
  const auto count = static_cast<int>(layout.parts().size());
  const auto kind = [&](int part) { return layout.parts()[part].id.kind(); };
  for (int p = 0; p < count; ++p) {
    const bool is_phi = layout.parts()[p].id.is_phi();
    (is_phi ? network.phi : network.rho)[kind(p)] = layout.stored(theta, p);
    for (int r = 0; is_phi && r < count; ++r) {
      if (layout.parts()[r].id.is_rho()) bounds.push_back({p, r, 0});
    }
  }
  files::parallel_for(static_cast<int>(bounds.size()), jobs, [&](int i) {
    JointBound& bound = bounds[static_cast<std::size_t>(i)];
    const std::string phi = kind(bound.phi), rho = kind(bound.rho);
    const files::FunctionId function = files::FunctionId::set(phi, rho);
    const lipschitz::SdpBound found = lipschitz::sdp_bound(check::stages(network, function));
    bound.upper = product_of_norms(network.phi.at(phi), network.rho.at(rho)).value();
    if (found.proof) bound.upper = std::min(bound.upper, found.proof->upper.value());
  });
  return bounds;
}

std::vector<double> shares_of_product(double limit, training::Layers layers,
                                      const files::GammaStatement& gamma, const training::Layout& layout) {
  const auto& parts = layout.parts();
  std::vector<double> shares(parts.size(), 1.0);
  for (std::size_t phi = 0; phi < parts.size(); ++phi) {
    for (std::size_t rho = 0; rho < parts.size(); ++rho) {
      if (!parts[phi].id.is_phi() || !parts[rho].id.is_rho()) continue;
      const int of_phi = parts[phi].layers(), of_rho = parts[rho].layers();
      const double product =
          limit * training::slack_of_product(layers, of_phi) * training::slack_of_product(layers, of_rho);
      const double of_layer = std::pow(product, 1.0 / (of_phi + of_rho));
      for (const std::size_t part : {phi, rho})
        shares[part] = std::min(shares[part], of_layer / training::layer_limit(gamma, parts[part].layers()));
    }
  }
  return shares;
}

Tightening scale_to(double limit, const training::Layout& layout, int jobs, training::Vector& theta) {
  const std::size_t count = layout.parts().size();
  Tightening result;
  result.shares.assign(count, 1.0);
  std::vector<double> ratio(count, 0.0);
  for (const JointBound& bound : joint_bounds(layout, theta, jobs)) {
    result.largest = std::max(result.largest, bound.upper);
    const int layers = layout.parts()[bound.phi].layers() + layout.parts()[bound.rho].layers();
    for (const int part : {bound.phi, bound.rho}) {
      const double over = bound.upper / limit;
      if (over <= ratio[part]) continue;
      ratio[part] = over;
      result.shares[part] = std::pow(over, -1.0 / layers);
    }
  }
  for (std::size_t p = 0; p < count; ++p) {
    if (!layout.parts()[p].id.is_rho() || !(ratio[p] > 1)) continue;
    const int part = static_cast<int>(p);
    layout.weights(theta, part, layout.parts()[p].layers() - 1) *=
        static_cast<float>((1 - kScalingHeadroom) / ratio[p]);
  }
  return result;
}

void limit_joint_bounds(double limit, const training::Layout& layout, int jobs, training::Vector& theta) {
  for (int tries = 0; tries < kMostScalings; ++tries) {
    if (scale_to(limit, layout, jobs, theta).largest <= limit) return;
  }
  throw std::runtime_error("the limit of the joint Lipschitz bounds could not be proved");
}

}  // namespace swarmcert::learning

/// @file Networks shared by tests of bounds, and sampled slopes to compare with bounds.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "lipschitz/checker/stages.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/upper/sdp_bound.h"
#include "nn/random_network.h"
#include "nn/weights/network.h"

namespace swarmcert::tests {

/// Returns a NET with one plain network.
inline files::Network plain(files::Weights weights) {
  files::Network network;
  network.plain = std::move(weights);
  return network;
}

/// Returns the slope function of one plain network; `weights` is not owned.
inline lipschitz::SlopeFunction slope_of(const files::Weights& weights) {
  return {{&weights, nullptr}, {}, nullptr};
}

/// Returns a NET with phi and rho of kind "default".
inline files::Network deep_set(files::Weights phi, files::Weights rho) {
  files::Network network;
  network.phi["default"] = std::move(phi);
  network.rho["default"] = std::move(rho);
  return network;
}

inline lipschitz::SdpBound sdp_bound_of(const files::Network& network,
                                        const files::FunctionId& function = "network") {
  return lipschitz::sdp_bound(check::stages(network, function));
}

/// Returns the proved bound; if there is none, fails the test and returns NaN.
inline double proved(const lipschitz::SdpBound& bound) {
  EXPECT_TRUE(bound.proof.has_value()) << "no iterate could be proved: " << name(bound.stop);
  return bound.proof ? bound.proof->upper.value() : std::nan("");
}

inline files::Layer layer(int outputs, int inputs, std::vector<double> weights) {
  return {"fc", outputs, inputs, std::move(weights),
          std::vector<double>(static_cast<std::size_t>(outputs), 0.0)};
}

inline files::Weights weights(std::vector<files::Layer> layers) {
  files::Weights result;
  result.path = "made by a test";
  result.layers = std::move(layers);
  for (std::size_t k = 0; k < result.layers.size(); ++k) result.layers[k].name = "fc" + std::to_string(k + 1);
  return result;
}

/// Returns the largest slope of `network` over pairs of random points at several distances: a lower bound up to
/// round-off.
inline double sampled_slope(const files::Weights& network, std::mt19937& generator, int samples) {
  const files::Evaluator<double> f(network);
  double steepest = 0;
  for (int s = 0; s < samples; ++s) {
    const double radius = std::exp2(static_cast<double>(generator() % 12) - 6.0);
    std::vector<double> x, y;
    for (int i = 0; i < network.inputs(); ++i) {
      x.push_back(4.0 * static_cast<double>(random_number(generator)));
      y.push_back(x.back() + radius * static_cast<double>(random_number(generator)));
    }
    const std::vector<double> fx = f(x);
    const std::vector<double> fy = f(y);
    double moved = 0;
    double changed = 0;
    for (std::size_t i = 0; i < x.size(); ++i) moved += (x[i] - y[i]) * (x[i] - y[i]);
    for (std::size_t i = 0; i < fx.size(); ++i) changed += (fx[i] - fy[i]) * (fx[i] - fy[i]);
    if (moved > 0) steepest = std::max(steepest, std::sqrt(changed / moved));
  }
  return steepest;
}

}  // namespace swarmcert::tests

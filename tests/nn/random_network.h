/// @file Seeded networks of any size for tests.
#pragma once

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "nn/weights/weights.h"

namespace swarmcert::tests {

/// Returns a float in [-1, 1) with 24 random bits; the same on every platform, unlike std::uniform_real_distribution.
inline float random_number(std::mt19937& generator) {
  return static_cast<float>(static_cast<std::int32_t>(generator() >> 8) - (1 << 23)) * 0x1p-23f;
}

/// Sets the same activation between all layers.
inline void set_activation(files::Weights& weights, files::Activation activation) {
  weights.set_activations(std::vector<files::Activation>(weights.layers.size() - 1, activation));
}

/// Returns fully connected layers "fc1", "fc2", ... with `sizes` = {inputs, hidden..., outputs}. The entries are
/// floats, scaled so that the norm of a random vector is approximately preserved.
inline files::Weights random_network(const std::vector<int>& sizes, std::mt19937& generator) {
  files::Weights weights;
  weights.path = "random";
  for (std::size_t k = 1; k < sizes.size(); ++k) {
    files::Layer layer;
    layer.name = "fc" + std::to_string(k);
    layer.inputs = sizes[k - 1];
    layer.outputs = sizes[k];
    const double scale = std::exp2(std::floor(std::log2(2 / std::sqrt(layer.inputs))));
    for (int i = 0; i < layer.outputs * layer.inputs; ++i) {
      layer.weights.push_back(scale * static_cast<double>(random_number(generator)));
    }
    for (int i = 0; i < layer.outputs; ++i)
      layer.biases.push_back(static_cast<double>(random_number(generator)) / 4);
    weights.layers.push_back(layer);
  }
  return weights;
}

}  // namespace swarmcert::tests

/// @file Networks of the paper's sizes with their own weights, for images that run on the microcontroller.
#pragma once

#include "nn/deep_set.h"

namespace swarmcert::tests {

/// The paper's sizes: phi 6-25-40-40-40, ground 4-25-40-40-40, rho 40-40-40-40-1.
inline constexpr int kHidden = 40;

/// Weights of one network with four layers. Random numbers fill the arrays in memory order, whatever the layout.
template <int Inputs, int First, int Outputs, nn::Layout layout = nn::Layout::kBlocks>
struct FourLayers {
  float w1[First * Inputs], b1[First], w2[kHidden * First], b2[kHidden], w3[kHidden * kHidden], b3[kHidden],
      w4[Outputs * kHidden], b4[Outputs];
  nn::DenseLayer<float> layers[4];

  template <typename Next>
  void fill(Next&& next) {
    const auto all = [&](auto& numbers, int fan_in) {
      for (float& w : numbers) w = nn::rounded(next() * (2.0f / static_cast<float>(fan_in))) * 1.5f;
    };
    all(w1, Inputs), all(b1, 8), all(w2, First), all(b2, 8);
    all(w3, kHidden), all(b3, 8), all(w4, kHidden), all(b4, 8);
    layers[0] = {w1, b1, First, Inputs, layout};
    layers[1] = {w2, b2, kHidden, First, layout};
    layers[2] = {w3, b3, kHidden, kHidden, layout};
    layers[3] = {w4, b4, Outputs, kHidden, layout};
  }
  nn::Mlp<float> mlp() const { return {layers, 4}; }
};

}  // namespace swarmcert::tests

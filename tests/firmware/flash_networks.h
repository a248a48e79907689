/// @file Networks of the paper's sizes with weights computed by the compiler, so that they lie in flash as in flight.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "nn/mlp.h"

namespace swarmcert::tests {

/// Number of floats in the weights and biases of the first `layers` layers. Each array starts at a line of the flash
/// cache, as in an export.
constexpr int count_numbers(const int* sizes, int layers) {
  int count = 0;
  for (int k = 0; k < layers; ++k) {
    for (const int size : {sizes[k] * sizes[k + 1], sizes[k + 1]}) count += (size + 3) / 4 * 4;
  }
  return count;
}

/// sizes: inputs, outputs of the first layer, ..., outputs of the last. The numbers are random, so that any layout
/// can use them.
template <int... sizes>
struct FlashNetwork {
  static constexpr int kSizes[] = {sizes...};
  static constexpr int kLayers = sizeof...(sizes) - 1;
  static constexpr int kNumbers = count_numbers(kSizes, kLayers);

  alignas(16) float values[static_cast<std::size_t>(kNumbers)] = {};

  static constexpr FlashNetwork random(std::uint32_t state) {
    FlashNetwork network;
    for (float& value : network.values) {
      state = state * 1664525u + 1013904223u;
      value = static_cast<float>(static_cast<std::int32_t>(state >> 8) - (1 << 23)) * 0x1p-23f * 0.25f;
    }
    return network;
  }

  void layers(nn::DenseLayer<float>* result) const {
    for (int k = 0; k < kLayers; ++k) {
      const int inputs = kSizes[k], outputs = kSizes[k + 1];
      const float* const weights = values + count_numbers(kSizes, k);
      result[k] = {weights, weights + (inputs * outputs + 3) / 4 * 4, outputs, inputs, nn::Layout::kBlocks};
    }
  }
};

}  // namespace swarmcert::tests

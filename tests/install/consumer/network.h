/// @file A fixed network for the consumer, and two ways of evaluating it besides the library's.
#pragma once

#include <cstdint>

inline constexpr int kLayers = 3;
inline constexpr int kSizes[kLayers + 1] = {6, 24, 24, 3};
inline constexpr int kWidest = 24;

/// f(input) of a FixedNetwork.
template <typename Scalar>
struct Output {
  Scalar y[kSizes[kLayers]];
};

/// Weights, biases and input in [-1, 1), float32 values that are the same on every machine.
template <typename Scalar>
struct FixedNetwork {
  Scalar weights[kLayers][kWidest * kWidest], biases[kLayers][kWidest], input[kSizes[0]];

  FixedNetwork() {
    for (int k = 0; k < kLayers; ++k) {
      for (Scalar& w : weights[k]) w = next();
      for (Scalar& b : biases[k]) b = next();
    }
    for (Scalar& x : input) x = next();
  }

 private:
  Scalar next() {
    state_ = state_ * 1664525u + 1013904223u;
    return static_cast<Scalar>(static_cast<std::int32_t>(state_ & 0xffffff00u)) / Scalar(2147483648.0);
  }
  std::uint32_t state_ = 1;
};

/// In guarded.cpp: the installed evaluator.
Output<float> guarded(const FixedNetwork<float>& network);
Output<double> guarded(const FixedNetwork<double>& network);
bool guarded_is_fused();

/// In unguarded.cpp: an ordinary loop, left to the compiler.
Output<float> unguarded(const FixedNetwork<float>& network);
Output<double> unguarded(const FixedNetwork<double>& network);
bool has_fused_instructions();

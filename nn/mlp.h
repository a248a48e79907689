/// @file Evaluation of a ReLU multilayer perceptron; the code that is analysed is the code that flies.
#pragma once

#include "nn/arithmetic.h"

namespace swarmcert::nn {

/// One affine layer y = W x + b. The caller owns the arrays.
template <typename Scalar>
struct DenseLayer {
  const Scalar* weights;  ///< W, [outputs x inputs], row-major.
  const Scalar* biases;   ///< b, [outputs].
  int outputs;
  int inputs;
};

/// f(x) = W_K relu(... relu(W_1 x + b_1) ...) + b_K: ReLU after every layer but the last.
/// Precondition: num_layers >= 1 and layers[k].inputs == layers[k - 1].outputs.
template <typename Scalar>
struct Mlp {
  const DenseLayer<Scalar>* layers;
  int num_layers;

  int inputs() const { return layers[0].inputs; }
  int outputs() const { return layers[num_layers - 1].outputs; }
};

/// Elements that evaluate() needs in `scratch`: two buffers as wide as the widest hidden layer.
template <typename Scalar>
constexpr int scratch_size(const Mlp<Scalar>& network) {
  int widest = 0;
  for (int k = 0; k + 1 < network.num_layers; ++k) {
    if (network.layers[k].outputs > widest) widest = network.layers[k].outputs;
  }
  return 2 * widest;
}

/// max(x, 0). A NaN stays a NaN, so that it reaches the caller's check instead of becoming a zero.
template <typename Scalar>
[[gnu::always_inline]] inline Scalar relu(Scalar x) {
  return x < Scalar(0) ? Scalar(0) : x;
}

/// y = W x + b in the fixed order: bias first, then inputs ascending, one accumulator per output, each product
/// rounded before the sum. Changing the order changes bits.
///
/// Four outputs at a time, in scalars of their own (compilers do not unroll an array of accumulators): each input is
/// loaded once for four products, and the processor has four independent sums to work on. No output's order changes.
template <typename Scalar>
inline void apply(const DenseLayer<Scalar>& layer, const Scalar* x, Scalar* y) {
  int i = 0;
  for (; i + 4 <= layer.outputs; i += 4) {
    const Scalar* const row0 = layer.weights + static_cast<long>(i) * layer.inputs;
    const Scalar* const row1 = row0 + layer.inputs;
    const Scalar* const row2 = row1 + layer.inputs;
    const Scalar* const row3 = row2 + layer.inputs;
    Scalar sum0 = layer.biases[i], sum1 = layer.biases[i + 1];
    Scalar sum2 = layer.biases[i + 2], sum3 = layer.biases[i + 3];
    for (int j = 0; j < layer.inputs; ++j) {
      const Scalar input = x[j];
      sum0 += rounded(row0[j] * input);
      sum1 += rounded(row1[j] * input);
      sum2 += rounded(row2[j] * input);
      sum3 += rounded(row3[j] * input);
    }
    y[i] = sum0, y[i + 1] = sum1, y[i + 2] = sum2, y[i + 3] = sum3;
  }
  for (; i < layer.outputs; ++i) {
    const Scalar* const row = layer.weights + static_cast<long>(i) * layer.inputs;
    Scalar sum = layer.biases[i];
    for (int j = 0; j < layer.inputs; ++j) sum += rounded(row[j] * x[j]);
    y[i] = sum;
  }
}

/// Evaluates `network`.
/// @param input   [network.inputs()].
/// @param output  [network.outputs()]; may not overlap `input` or `scratch`.
/// @param scratch [scratch_size(network)].
template <typename Scalar>
inline void evaluate(const Mlp<Scalar>& network, const Scalar* input, Scalar* output, Scalar* scratch) {
  Scalar* current = scratch;
  Scalar* next = scratch + scratch_size(network) / 2;
  const Scalar* x = input;
  for (int k = 0; k + 1 < network.num_layers; ++k) {
    const DenseLayer<Scalar>& layer = network.layers[k];
    apply(layer, x, next);
    for (int i = 0; i < layer.outputs; ++i) next[i] = relu(next[i]);
    x = next;
    Scalar* const free_buffer = current;
    current = next;
    next = free_buffer;
  }
  apply(network.layers[network.num_layers - 1], x, output);
}

}  // namespace swarmcert::nn

/// @file Evaluation of a ReLU multilayer perceptron; the code that is analysed is the code that flies.
#pragma once

#include "nn/dense_layer.h"

namespace swarmcert::nn {

/// f(x) = W_K relu(... relu(W_1 x + b_1) ...) + b_K: ReLU after every layer but the last.
/// Precondition: is_chain(network).
template <typename Scalar>
struct Mlp {
  const DenseLayer<Scalar>* layers;
  int num_layers;

  constexpr int inputs() const { return layers[0].inputs; }
  constexpr int outputs() const { return layers[num_layers - 1].outputs; }
};

/// Returns true if there is at least one layer and the sizes of consecutive layers match. Intended for a static_assert
/// on weights that are known at compile time.
template <typename Scalar>
constexpr bool is_chain(const Mlp<Scalar>& network) {
  for (int k = 1; k < network.num_layers; ++k) {
    if (network.layers[k].inputs != network.layers[k - 1].outputs) return false;
  }
  return network.num_layers >= 1;
}

/// Returns the number of elements that evaluate() needs in `scratch`: two buffers as wide as the widest hidden layer,
/// for each of the `together` inputs that are evaluated at once.
template <typename Scalar>
constexpr int scratch_size(const Mlp<Scalar>& network, int together = 1) {
  int widest = 0;
  for (int k = 0; k + 1 < network.num_layers; ++k) {
    if (network.layers[k].outputs > widest) widest = network.layers[k].outputs;
  }
  return 2 * widest * together;
}

/// Evaluates `network` for `Inputs` inputs at once; each output has the same bits as if evaluated alone.
/// @param input   [network.inputs() x Inputs]: entry j of input c is input[j * Inputs + c].
/// @param output  [network.outputs() x Inputs] likewise; must not overlap `input` or `scratch`.
/// @param scratch [scratch_size(network, Inputs)].
template <int Inputs, typename Scalar>
inline void evaluate_together(const Mlp<Scalar>& network, const Scalar* input, Scalar* output,
                              Scalar* scratch) {
  Scalar* current = scratch;
  Scalar* next = scratch + scratch_size(network, Inputs) / 2;
  const Scalar* x = input;
  for (int k = 0; k + 1 < network.num_layers; ++k) {
    apply<Inputs>(network.layers[k], x, next, Activation::kRelu);
    x = next;
    Scalar* const free_buffer = current;
    current = next;
    next = free_buffer;
  }
  apply<Inputs>(network.layers[network.num_layers - 1], x, output, Activation::kNone);
}

/// Evaluates `network`.
/// @param input   [network.inputs()].
/// @param output  [network.outputs()]; must not overlap `input` or `scratch`.
/// @param scratch [scratch_size(network)].
template <typename Scalar>
inline void evaluate(const Mlp<Scalar>& network, const Scalar* input, Scalar* output, Scalar* scratch) {
  evaluate_together<1>(network, input, output, scratch);
}

}  // namespace swarmcert::nn

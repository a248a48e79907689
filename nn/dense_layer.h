/// @file One affine layer and the loop that evaluates it, for one input or for several at once.
///
/// Every output is one sum: the bias, then the products of the inputs in ascending order, in one accumulator, each
/// product rounded before it is added. No layout of the weights and no grouping of outputs or inputs changes a bit.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

#include "nn/arithmetic.h"

namespace swarmcert::nn {

/// Where the weight of output i and input j lies.
enum class Layout : std::uint8_t {
  /// weights[i * inputs + j], as weight files have it.
  kRows,
  /// Outputs in blocks of eight, then, of what is left, one of four, of two and of one; within a block the inputs
  /// ascending, and for each input the weights of the block's outputs side by side: what a processor reads in a row.
  kBlocks
};

/// One affine layer y = W x + b. The caller owns the arrays.
template <typename Scalar>
struct DenseLayer {
  const Scalar* weights;  ///< W, [outputs x inputs] in `layout`.
  const Scalar* biases;   ///< b, [outputs].
  int outputs;
  int inputs;
  Layout layout = Layout::kRows;
};

/// A layer in blocks whose sizes are checked when it is compiled: arrays of another size do not convert.
template <int Outputs, int Inputs, typename Scalar>
constexpr DenseLayer<Scalar> layer_in_blocks(const Scalar (&weights)[Outputs * Inputs],
                                             const Scalar (&biases)[Outputs]) {
  return {weights, biases, Outputs, Inputs, Layout::kBlocks};
}

/// Outputs of the block of Layout::kBlocks that begins at output `first`.
constexpr int block_width(int outputs, int first) {
  const int left = outputs - first;
  return left >= 8 ? 8 : left >= 4 ? 4 : left >= 2 ? 2 : 1;
}

/// Copies W from rows to blocks; both [outputs x inputs], not overlapping.
template <typename Scalar>
inline void to_blocks(const Scalar* rows, int outputs, int inputs, Scalar* blocks) {
  for (int first = 0; first < outputs; first += block_width(outputs, first)) {
    const int width = block_width(outputs, first);
    for (int j = 0; j < inputs; ++j) {
      for (int i = 0; i < width; ++i) *blocks++ = rows[static_cast<long>(first + i) * inputs + j];
    }
  }
}

/// max(x, 0) after an affine layer, or nothing. A NaN stays a NaN, so that it reaches the caller's check instead of
/// becoming a zero.
enum class Activation : std::uint8_t { kNone, kRelu };

namespace detail {

/// Weights w[i * row + j * column] of the outputs i of one block.
template <typename Scalar>
struct BlockWeights {
  const Scalar* first;
  long row, column;
};

/// y[i * Inputs + c] = b[i] + sum_j w(i, j) x[j * Inputs + c]: k stands for i * Inputs + c. The sums are named by
/// constant indices, because compilers do not keep an array in registers that a loop walks through.
/// @param zero 0.
template <int Inputs, int Outputs, typename Scalar, int... k>
[[gnu::always_inline]] inline void apply_block(const BlockWeights<Scalar>& weights, const Scalar* biases,
                                               int inputs, const Scalar* x, Scalar* y, Activation activation,
                                               Scalar zero, std::integer_sequence<int, k...>) {
  static_assert(sizeof...(k) == Inputs * Outputs);
  Scalar sum[] = {biases[k / Inputs]...};
  const Scalar* w = weights.first;
  for (const Scalar* const end = x + static_cast<long>(inputs) * Inputs; x != end; x += Inputs) {
    ((sum[k] += rounded(w[k / Inputs * weights.row] * x[k % Inputs])), ...);
    w += weights.column;
  }
  if (activation == Activation::kRelu) {
    ((y[k] = sum[k] < zero ? zero : sum[k]), ...);
  } else {
    ((y[k] = sum[k]), ...);
  }
}

}  // namespace detail

/// y = W x + b, or relu(W x + b), for `Inputs` inputs at once: each weight is loaded once for all of them.
/// @param x [layer.inputs x Inputs]: entry j of input c is x[j * Inputs + c].
/// @param y [layer.outputs x Inputs] likewise; may not overlap x.
template <int Inputs, typename Scalar>
inline void apply(const DenseLayer<Scalar>& layer, const Scalar* x, Scalar* y, Activation activation) {
  // A zero that the compiler does not know: one that it knows it loads from flash again for each comparison.
  volatile Scalar unknown = Scalar(0);
  const Scalar zero = unknown;
  const long inputs = layer.inputs;
  const auto block = [&](auto width, int first, long offset, long row, long column) {
    constexpr int kWidth = decltype(width)::value;
    detail::apply_block<Inputs, kWidth>(
        detail::BlockWeights<Scalar>{layer.weights + first * inputs + offset, row, column},
        layer.biases + first, layer.inputs, x, y + static_cast<long>(first) * Inputs, activation, zero,
        std::make_integer_sequence<int, kWidth * Inputs>());
  };
  constexpr std::integral_constant<int, 1> one;
  constexpr std::integral_constant<int, 2> two;
  constexpr std::integral_constant<int, 4> four;
  constexpr std::integral_constant<int, 8> eight;
  int i = 0;
  if (layer.layout == Layout::kRows) {
    for (; i + 4 <= layer.outputs; i += 4) block(four, i, 0, inputs, 1);
    for (; i < layer.outputs; ++i) block(one, i, 0, inputs, 1);
    return;
  }
  for (; i + 8 <= layer.outputs; i += 8) {
    if constexpr (Inputs <= 2) {
      block(eight, i, 0, 1, 8);
    } else {  // twelve sums fit into the registers with what they need beside them, twenty-four do not
      block(four, i, 0, 1, 8);
      block(four, i + 4, 4 - 4 * inputs, 1, 8);  // in the same block, beside the first four
    }
  }
  if (layer.outputs - i >= 4) block(four, i, 0, 1, 4), i += 4;
  if (layer.outputs - i >= 2) block(two, i, 0, 1, 2), i += 2;
  if (layer.outputs - i >= 1) block(one, i, 0, 1, 1);
}

}  // namespace swarmcert::nn

/// @file One affine layer and the loop that evaluates it, for one input or several at once.
///
/// Each output is a single sum: the bias, then the products with the inputs in ascending order, in one accumulator;
/// each product is rounded before it is added. The bits of the result do not depend on the layout of the weights or on
/// how outputs and inputs are grouped.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

#include "nn/arithmetic.h"

namespace swarmcert::nn {

/// Memory layout of a weight matrix.
enum class Layout : std::uint8_t {
  /// weights[i * inputs + j] for output i and input j, as in weight files.
  kRows,
  /// Outputs in blocks of eight; the remaining outputs in at most one block each of four, two and one. Within a block,
  /// inputs are in ascending order, and the weights of the block's outputs for one input are adjacent, so that the
  /// weights are read sequentially.
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

/// Makes a layer with Layout::kBlocks. Arrays of the wrong size do not compile.
template <int Outputs, int Inputs, typename Scalar>
constexpr DenseLayer<Scalar> layer_in_blocks(const Scalar (&weights)[Outputs * Inputs],
                                             const Scalar (&biases)[Outputs]) {
  return {weights, biases, Outputs, Inputs, Layout::kBlocks};
}

/// Returns the number of outputs in the Layout::kBlocks block that starts at output `first`.
constexpr int block_width(int outputs, int first) {
  const int left = outputs - first;
  return left >= 8 ? 8 : left >= 4 ? 4 : left >= 2 ? 2 : 1;
}

/// Copies W from Layout::kRows to Layout::kBlocks. Both arrays are [outputs x inputs] and must not overlap.
template <typename Scalar>
inline void to_blocks(const Scalar* rows, int outputs, int inputs, Scalar* blocks) {
  for (int first = 0; first < outputs; first += block_width(outputs, first)) {
    const int width = block_width(outputs, first);
    for (int j = 0; j < inputs; ++j) {
      for (int i = 0; i < width; ++i) *blocks++ = rows[static_cast<long>(first + i) * inputs + j];
    }
  }
}

/// Function applied after an affine layer: none, or max(x, 0). NaN stays NaN, so that it reaches the caller's check
/// instead of becoming zero.
enum class Activation : std::uint8_t { kNone, kRelu };

namespace detail {

/// Weights of one block: the weight of output i and input j is first[i * row + j * column].
template <typename Scalar>
struct BlockWeights {
  const Scalar* first;
  long row, column;
};

/// Computes y[i * Inputs + c] = b[i] + sum_j w(i, j) x[j * Inputs + c] for one block. The pack k enumerates i * Inputs
/// + c, so that every sum has a constant index: compilers do not keep an array in registers if a loop indexes it.
/// @param zero must be 0; see apply().
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

/// Computes y = W x + b, or relu(W x + b), for `Inputs` inputs at once, loading each weight only once.
/// @param x [layer.inputs x Inputs]: entry j of input c is x[j * Inputs + c].
/// @param y [layer.outputs x Inputs] likewise; must not overlap x.
template <int Inputs, typename Scalar>
inline void apply(const DenseLayer<Scalar>& layer, const Scalar* x, Scalar* y, Activation activation) {
  // The zero is hidden from the optimiser, which would otherwise reload the constant from flash for each comparison.
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
    } else {  // twelve sums and their operands fit into the registers, twenty-four sums do not
      block(four, i, 0, 1, 8);
      block(four, i + 4, 4 - 4 * inputs, 1, 8);  // second half of the same block of eight
    }
  }
  if (layer.outputs - i >= 4) block(four, i, 0, 1, 4), i += 4;
  if (layer.outputs - i >= 2) block(two, i, 0, 1, 2), i += 2;
  if (layer.outputs - i >= 1) block(one, i, 0, 1, 1);
}

}  // namespace swarmcert::nn

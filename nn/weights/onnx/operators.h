/// @file ONNX operators as affine maps, and the shapes that they give. https://onnx.ai/onnx/operators/
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/affine_map.h"
#include "nn/weights/onnx/model.h"

namespace swarmcert::files {

/// Entries that the input, or the result of a convolution, may have.
inline constexpr std::uint64_t kMostRows = std::uint64_t{1} << 20;

using OnnxShape = std::vector<std::int64_t>;  ///< every size at least 1; the batch is 1

/// Thrown by the functions here; the reader adds file, offset and node.
struct OperatorRefusal {
  std::string what;
  std::string hint = kReexportOnnx;
};

/// A tensor that the network computes, row-major, as an affine map of the last ReLU layer's outputs.
struct OnnxValue {
  AffineMap map;
  OnnxShape shape;
  std::string name;  ///< of the first weights since that layer; empty: none yet
};

std::int64_t count_of(const OnnxShape& shape);

/// `axis` counted from the end where negative. @throws OperatorRefusal.
std::size_t axis_of(std::int64_t axis, std::size_t rank);

/// The numbers of a tensor as ONNX broadcasts them to `shape`, one per entry.
/// @throws OperatorRefusal if they cannot be, or are not floating-point numbers.
std::vector<Enclosed> broadcast(const OnnxTensor& tensor, const OnnxShape& shape);

/// The shape that Reshape gives: 0 copies a size, -1 is what is left.
OnnxShape reshaped(const OnnxShape& shape, const std::vector<std::int64_t>& wanted, bool zero_is_zero);

/// For each entry of the transposed tensor the entry of the original one.
std::vector<int> transposition(const OnnxShape& shape, const std::vector<std::int64_t>& permutation,
                               OnnxShape& result);

/// y = x W + c of Gemm and MatMul; the leading sizes of `shape` are 1. `result` is the shape of y.
AffineMap gemm_map(const OnnxNode& node, const OnnxTensor& weight, const OnnxTensor* bias,
                   const OnnxShape& shape, OnnxShape& result);
AffineMap matmul_map(const OnnxTensor& weight, bool weight_is_left, const OnnxShape& shape,
                     OnnxShape& result);

/// Convolution over one or more axes, with groups, strides, dilations and padding.
AffineMap convolution_map(const OnnxNode& node, const OnnxTensor& weight, const OnnxTensor* bias,
                          const OnnxShape& shape, OnnxShape& result);

/// AveragePool and GlobalAveragePool.
AffineMap average_map(const OnnxNode& node, const OnnxShape& shape, OnnxShape& result);

/// Of each entry of MaxPool's or GlobalMaxPool's result, the entries of which it is the largest.
std::vector<std::vector<int>> max_windows(const OnnxNode& node, const OnnxShape& shape, OnnxShape& result);

/// Factor and amount of each entry: y = factor x + amount, of BatchNormalization in inference.
/// @param parameters scale, B, input_mean, input_var.
void batch_normalization(const OnnxNode& node, const std::vector<const OnnxTensor*>& parameters,
                         const OnnxShape& shape, std::vector<Enclosed>& factors,
                         std::vector<Enclosed>& amounts);

}  // namespace swarmcert::files

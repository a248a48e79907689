/// @file ONNX operators as affine maps, with the shapes of their results. https://onnx.ai/onnx/operators/
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/affine_map.h"
#include "nn/weights/onnx/model.h"

namespace swarmcert::files {

/// Maximum number of entries of the input, or of the result of a convolution.
inline constexpr std::uint64_t kMostRows = std::uint64_t{1} << 20;

/// ONNX's SELU has float32 constants: its slopes are those of SELU times a factor between 1 and 1 + kSeluRounding. 1 +
/// 3.32e-8 = 1.05070102214813232421875 / 1.0507009873554804934... for x > 0, and less for x < 0.
inline constexpr double kSeluRounding = 3.4e-8;

using OnnxShape = std::vector<std::int64_t>;  ///< every size at least 1; the batch is 1

/// Thrown by these functions; the reader adds file, offset and node.
struct OperatorRefusal {
  std::string what;
  std::string hint = kReexportOnnx;
};

/// A row-major tensor computed by the network, as an affine map of the outputs of the last ReLU layer.
struct OnnxValue {
  AffineMap map;
  OnnxShape shape;
  std::string name;  ///< of the first weights after that layer; empty: none yet
};

std::int64_t count_of(const OnnxShape& shape);

/// Returns `axis`, counted from the end if negative. @throws OperatorRefusal.
std::size_t axis_of(std::int64_t axis, std::size_t rank);

/// Broadcasts the numbers of a tensor to `shape` by the rules of ONNX and returns one per entry.
/// @throws OperatorRefusal if they cannot be broadcast or are not floating-point numbers.
std::vector<Enclosed> broadcast(const OnnxTensor& tensor, const OnnxShape& shape);

/// Returns the result shape of Reshape: 0 copies a size, -1 is inferred.
OnnxShape reshaped(const OnnxShape& shape, const std::vector<std::int64_t>& wanted, bool zero_is_zero);

/// Returns for each entry of the transposed tensor the index of the original entry.
std::vector<int> transposition(const OnnxShape& shape, const std::vector<std::int64_t>& permutation,
                               OnnxShape& result);

/// Return the map y = x W + c of Gemm and MatMul. The leading sizes of `shape` must be 1. `result` is the shape of y.
AffineMap gemm_map(const OnnxNode& node, const OnnxTensor& weight, const OnnxTensor* bias,
                   const OnnxShape& shape, OnnxShape& result);
AffineMap matmul_map(const OnnxTensor& weight, bool weight_is_left, const OnnxShape& shape,
                     OnnxShape& result);

/// Returns the map of a convolution over one or more axes, with groups, strides, dilations and padding.
AffineMap convolution_map(const OnnxNode& node, const OnnxTensor& weight, const OnnxTensor* bias,
                          const OnnxShape& shape, OnnxShape& result);

/// Returns the map of AveragePool and GlobalAveragePool.
AffineMap average_map(const OnnxNode& node, const OnnxShape& shape, OnnxShape& result);

/// Returns for each entry of the result of MaxPool or GlobalMaxPool the entries whose maximum it is.
std::vector<std::vector<int>> max_windows(const OnnxNode& node, const OnnxShape& shape, OnnxShape& result);

/// Computes for each entry the factor and amount of y = factor x + amount, for BatchNormalization in inference.
/// @param parameters scale, B, input_mean, input_var.
void batch_normalization(const OnnxNode& node, const std::vector<const OnnxTensor*>& parameters,
                         const OnnxShape& shape, std::vector<Enclosed>& factors,
                         std::vector<Enclosed>& amounts);

}  // namespace swarmcert::files

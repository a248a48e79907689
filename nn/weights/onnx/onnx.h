/// @file ONNX models of affine and piecewise linear operations and of activations that are known.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// True if `bytes` begin as an ONNX model does: with its IR version and another field of a model.
bool looks_like_onnx(const std::string& bytes);

/// The network in `bytes`; `path` for messages.
///
/// Accepted nodes, from the graph's one input to its one output: affine ones (Gemm, MatMul, Conv, BatchNormalization in
/// inference, AveragePool, Add, Sub, Mul and Div by constants, skip connections), which are folded exactly or with the
/// rounding stated in Layer; piecewise linear ones (Relu, LeakyRelu, PRelu, Clip, HardSigmoid, Abs, Max, Min, MaxPool),
/// which are written with ReLU, the same function; smooth activations (Tanh, Sigmoid, Softplus, Elu, Gelu, x
/// Sigmoid(x)), past which skip connections are kept as they are; MaxMin and GroupSort without skip connections beside
/// them; and those that only rearrange. A Softmax at the end is left out. Behind any other activation at the end
/// follows an identity layer. Weights lie in the file itself, in float16, bfloat16, float32 or float64. The batch is 1.
/// A layer is called as its first weight without ".weight".
/// @throws InputError for anything else, naming node, tensor or attribute, or as assemble().
Weights parse_onnx(const std::string& bytes, const std::string& path, const std::vector<std::string>& order);

}  // namespace swarmcert::files

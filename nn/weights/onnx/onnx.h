/// @file ONNX models that consist of affine and piecewise linear operations and supported activations.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Returns true if `bytes` begin like an ONNX model: with its IR version and another field of a model.
bool looks_like_onnx(const std::string& bytes);

/// Parses the network in `bytes`; `path` is used in messages only.
///
/// Accepted nodes, from the graph's one input to its one output:
/// - affine: Gemm, MatMul, Conv, BatchNormalization in inference, AveragePool, Add, Sub, Mul and Div by constants, skip
///   connections; they are folded exactly, or with the rounding error stated in Layer;
/// - piecewise linear: Relu, LeakyRelu, PRelu, Clip, HardSigmoid, Abs, Max, Min, MaxPool; they are rewritten with
///   ReLU as the same function;
/// - smooth activations: Tanh, Sigmoid, Softplus, Elu, Gelu, x Sigmoid(x); skip connections past them are kept;
/// - MaxMin and GroupSort; beside a skip connection they are written with ReLU, groups of up to 8 numbers;
/// - nodes that only rearrange.
/// A final Softmax is omitted. Any other final activation is followed by an identity layer. Weights must be stored in
/// the file itself, as float16, bfloat16, float32 or float64. The batch size is 1. A layer is named after its first
/// weight, without ".weight".
/// @throws InputError with node, tensor or attribute for anything else, or as assemble().
Weights parse_onnx(const std::string& bytes, const std::string& path, const LayerChoice& choice);

}  // namespace swarmcert::files

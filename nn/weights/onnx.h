/// @file ONNX models that are one chain of affine layers with ReLU between them.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// True if `bytes` begin as an ONNX model does: with its IR version and another field of a model.
bool looks_like_onnx(const std::string& bytes);

/// The network in `bytes`; `path` for messages.
///
/// Accepted nodes, in a chain from the graph's one input to its one output: Gemm (alpha = beta = 1, the input not
/// transposed), MatMul with Add, Relu, Identity; Constant and Identity for weights. Weights lie in the file itself, in
/// float32 or float64. A layer is called as its weight without ".weight".
/// @throws InputError for anything else, naming node, tensor or attribute, or as assemble().
Weights parse_onnx(const std::string& bytes, const std::string& path, const std::vector<std::string>& order);

}  // namespace swarmcert::files

/// @file State dicts of networks with another piecewise linear activation than ReLU, as ReLU networks.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// What stated_activation() knows, for help and messages.
inline constexpr char kActivations[] = "relu, leaky_relu (slope 0.01), leaky_relu:SLOPE, relu6, hardtanh";

/// Whether `name` is one of kActivations.
bool is_activation(const std::string& name);

/// The network whose layers are those of `weights` with `activation` between them, written with ReLU, the same function:
/// leaky_relu(x) = relu(x) - a relu(-x), relu6(x) = relu(x) - relu(x - 6), hardtanh(x) = -1 + relu(x + 1) - relu(x - 1).
/// @throws InputError if the file itself states ReLU, or the network becomes too large.
/// @throws std::invalid_argument if `activation` is unknown.
Weights with_activation(Weights weights, const std::string& activation);

}  // namespace swarmcert::files

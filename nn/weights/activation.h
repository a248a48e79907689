/// @file The activation of weight files that state none: ReLU, another piecewise linear one, or a smooth one.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// What with_activation() knows, for help and messages.
std::string activations();

/// Whether `name` is one of activations().
bool is_activation(const std::string& name);

/// The network whose layers are those of `weights` with `activation` between them. Smooth activations
/// (activation_function.h) stay what they are; piecewise linear ones are written with ReLU, the same function:
/// leaky_relu(x) = relu(x) - a relu(-x), relu6(x) = relu(x) - relu(x - 6), hardtanh(x) = -1 + relu(x + 1) - relu(x -
/// 1).
/// @throws InputError if the file itself or network.toml states another activation, a hidden layer has no whole number
///   of groups, or the network becomes too large.
/// @throws std::invalid_argument if `activation` is unknown.
Weights with_activation(Weights weights, const std::string& activation);

}  // namespace swarmcert::files

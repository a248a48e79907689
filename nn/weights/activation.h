/// @file The activations of weight files that state none: ReLU, other piecewise linear ones, smooth ones.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// What with_activation() knows, for help and messages.
std::string activations();

/// Whether `name` is one of activations().
bool is_activation(const std::string& name);

/// "tanh,relu" as its names.
std::vector<std::string> listed_activations(const std::string& text);

/// Why `text` cannot be what with_activation() takes for these layers; empty: it can.
std::string activation_misfit(const Weights& weights, const std::string& text);

/// The network whose layers are those of `weights` with `text` between them: one name for all, or, separated by commas,
/// one for each layer but the last, and possibly one more, which follows the last layer. Nothing is between the layers
/// of a network of one, and one name means nothing there. Smooth activations (activation_function.h) stay what they
/// are; piecewise linear ones are written with ReLU, the same function:
/// leaky_relu(x) = relu(x) - a relu(-x), relu6(x) = relu(x) - relu(x - 6), hardtanh(x) = -1 + relu(x + 1) - relu(x -
/// 1).
/// @throws InputError if the file itself or network.toml states others, there are more or fewer than layers take, a
///   layer has no whole number of groups, or the network becomes too large.
/// @throws std::invalid_argument if a name is unknown.
Weights with_activation(Weights weights, const std::string& text);

}  // namespace swarmcert::files

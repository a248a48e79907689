/// @file Activations for weight files that do not state any: ReLU, other piecewise linear functions, smooth functions.
#pragma once

#include <string>
#include <vector>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Beginnings of guesses in Weights::assumed that are settled where the activations are stated: what is between the
/// layers, and what follows the last one, for which one more activation must be stated.
inline constexpr char kBetweenGuess[] = "between the layers: ", kEndGuess[] = "behind the last layer: ";

/// Returns the list of activations that with_activation() supports, for help and messages.
std::string activations();

/// Returns whether `name` is one of activations().
bool is_activation(const std::string& name);

/// Splits a comma-separated list such as "tanh,relu" into names.
std::vector<std::string> listed_activations(const std::string& text);

/// Returns why with_activation() cannot apply `text` to these layers; empty if it can.
std::string activation_misfit(const Weights& weights, const std::string& text);

/// Returns the network with the layers of `weights` and the activations `text`: one name for all layers but the last,
/// or a comma-separated list with one name for each layer but the last and optionally one more, which follows the last
/// layer. For a network of one layer, a single name has no effect. Smooth activations (activation_function.h) are kept;
/// piecewise linear ones are rewritten with ReLU as the same function:
/// leaky_relu(x) = relu(x) - a relu(-x), relu6(x) = relu(x) - relu(x - 6),
/// hardtanh(x) = -1 + relu(x + 1) - relu(x - 1). Guesses that the names settle are removed from `assumed`.
/// @throws InputError if the file itself or network.toml states other activations, the number of names does not match
///   the layers, the width of a layer is not a multiple of the group size, or the network becomes too large.
/// @throws std::invalid_argument if a name is unknown.
Weights with_activation(Weights weights, const std::string& text);

/// Same, with activations that the file itself states in `field`, in the words of MATLAB or PyTorch.
/// @throws InputError if a word is not known or the number of words does not match the layers.
Weights with_activation_of_file(Weights weights, const std::vector<std::string>& words,
                                const std::string& field);

}  // namespace swarmcert::files

/// @file The sequence of operations as which a stored network is interpreted, in the form used by certificates.
#pragma once

#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

struct ChainStep {
  std::string op;     ///< "clamp", "linear" (y = W x + b), or what ActivationFunction::op says
  std::string layer;  ///< for "linear": its name in the file, possibly empty
  int inputs = 0, outputs = 0;
  std::string words = {};  ///< for an activation: its name in prose
};

/// Returns the operations of `part` of NET in order of evaluation: the clamp if one applies, then its layers with an
/// activation after each but the last.
/// @throws std::out_of_range if NET has no such part.
std::vector<ChainStep> chain(const Network& network, const FunctionId& part);

/// Returns `[{op, layer, inputs, outputs}]`; `layer` is null for steps other than "linear".
Json chain_json(const std::vector<ChainStep>& chain);

/// Returns for example "fc1 - ReLU - fc2" or "clamp - fc1 - ReLU - fc2".
std::string chain_words(const std::vector<ChainStep>& chain);

/// Describes all parts: "fc1 - ReLU - fc2" for a plain network; else each distinct chain with the parts that have it,
/// "phi:large, phi:small: clamp - fc1 - ReLU - fc2; rho:small: ...", and silent
/// compositions.
std::string chain_words(const Network& network);

}  // namespace swarmcert::files

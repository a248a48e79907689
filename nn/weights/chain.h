/// @file The chain of operations that a stored network is taken to be, as results and certificates state it.
#pragma once

#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

struct ChainStep {
  std::string op;     ///< "clamp", "linear" (y = W x + b), or what ActivationFunction::op says
  std::string layer;  ///< of "linear": its name in the file, which may be empty
  int inputs = 0, outputs = 0;
  std::string words = {};  ///< of an activation, in texts
};

/// The operations of `part` of NET, first applied first: the clamp where one acts on it, then its layers with an
/// activation after each but the last.
/// @throws std::out_of_range if NET has no such part.
std::vector<ChainStep> chain(const Network& network, const FunctionId& part);

/// `[{op, layer, inputs, outputs}]`; `layer` is null where the step is none.
Json chain_json(const std::vector<ChainStep>& chain);

/// "fc1 - ReLU - fc2"; "clamp - fc1 - ReLU - fc2".
std::string chain_words(const std::vector<ChainStep>& chain);

/// Of all parts: "fc1 - ReLU - fc2" for a plain network; else one entry per chain with the parts that have it,
/// "phi:large, phi:small: clamp - fc1 - ReLU - fc2; rho:small: ...", and whether phi sees invariants.
std::string chain_words(const Network& network);

}  // namespace swarmcert::files

/// @file Networks evaluated in the style of the firmware used in the paper, to compare the cycle model with the known
/// time of that firmware. Compiled with that firmware's options, including contraction.
#pragma once

namespace swarmcert::tests {

/// @param values for each layer the weights, [inputs][outputs], followed by the biases.
/// @param buffers [80]; the result is in the last 40, or for rho in the element after the first 40.
void published_phi(const float* values, const float* input, float* buffers);
void published_rho(const float* values, const float* input, float* buffers);

}  // namespace swarmcert::tests

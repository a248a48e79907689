/// @file Networks evaluated in the style of the firmware that flew in the paper, to hold the cycle model against what
/// is known of its time. Compiled with that firmware's options, contraction included.
#pragma once

namespace swarmcert::tests {

/// @param values  of each layer the weights, [inputs][outputs], then the biases.
/// @param buffers [80]; the result is in the last 40, or for rho in the one after the first 40.
void published_phi(const float* values, const float* input, float* buffers);
void published_rho(const float* values, const float* input, float* buffers);

}  // namespace swarmcert::tests

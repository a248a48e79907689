/// @file Networks in MAT files, in the forms that LipSDP, ECLipsE, NNV and ARCH-COMP use.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Parses the network in `bytes`: a cell array "weights" or "W" of matrices [outputs, inputs], optionally with "biases"
/// or "b"; matrices with names that network_of_arrays() recognizes; or a single struct with such fields. Numeric arrays
/// may be of any class, compressed (-v7, -v7.3) or not (-v6). `act_fcns` states the activations; `means_for_scaling`
/// and `range_for_scaling` the normalization, as in .nnet. Counts of layers and sizes must agree. Any other variable is
/// named as unused, and the result assumes that it does not bear on the function.
/// @throws InputError with the offset for anything else.
Weights parse_mat(const std::string& bytes, const std::string& path, const LayerChoice& choice);

}  // namespace swarmcert::files

/// @file The .nnet text format of networks for collision avoidance (ACAS Xu).
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// True if the first line that is no comment ("//") is four counts with commas.
bool looks_like_nnet(const std::string& bytes);

/// The network with the file's normalization folded into its first and last layer: x -> (x - mean) / range of each
/// input, and back for the outputs. The clamp of the inputs to their least and largest values is left out. Decimal
/// numbers are read as the nearest doubles.
/// @throws InputError with the line.
Weights parse_nnet(const std::string& bytes, const std::string& path, const std::vector<std::string>& order);

}  // namespace swarmcert::files

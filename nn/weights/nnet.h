/// @file The .nnet text format of networks for collision avoidance (ACAS Xu).
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Returns true if the first line that is not a comment ("//") consists of four comma-separated counts.
bool looks_like_nnet(const std::string& bytes);

/// Parses the network and folds the file's normalization into its first and last layer: x -> (x - mean) / range for
/// each input, and the inverse for the outputs. The clamp of the inputs to their minimum and maximum values is omitted.
/// Decimal numbers are read as the nearest doubles.
/// @throws InputError with the line.
Weights parse_nnet(const std::string& bytes, const std::string& path, const LayerChoice& choice);

}  // namespace swarmcert::files

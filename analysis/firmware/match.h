/// @file Comparison of firmware files with the export of a network.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/firmware/float_blocks.h"
#include "nn/weights/network.h"

namespace swarmcert::firmware {

/// The first number that differs from the network.
struct Difference {
  std::string part, layer;  ///< "phi:small", "fc1"
  std::string entry;        ///< "weight[3][2]" or "bias[7]"; without an index if no data resemble the array
  float expected = 0;
  std::optional<float> found;  ///< empty if no numbers of the file resemble the array
  std::string name, place;     ///< variable or symbol, and line or address
};

struct MatchResult {
  bool equal() const { return !first_difference; }
  int arrays = 0;           ///< weight matrices and bias vectors searched for
  std::size_t numbers = 0;  ///< weights and biases in them
  std::optional<Difference> first_difference;
};

/// Index of the matrix entry (row-major) stored at each position of an array.
using Order = std::vector<std::size_t>;

/// The layouts in which weights are stored: row-major, column-major, nn::Layout::kBlocks.
std::vector<Order> orders(const files::Layer& layer);

/// Searches for every weight matrix (in any of orders()) and every bias vector as
/// contiguous runs of the same bits. A bias must be in the variable named like its matrix with "bias" instead of
/// "weight". If there is no such name, it must follow its matrix or, if it has at least four numbers, may be
/// anywhere: shorter runs occur by chance. Guarantee: `equal` means that all of them are in the file, bit for bit. It
/// says nothing about the code that reads them. Precondition: every weight is a float32 (files::as_float32()).
MatchResult match(const files::Network& network, const std::vector<FloatBlock>& blocks);

}  // namespace swarmcert::firmware

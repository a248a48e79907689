/// @file Comparison of firmware files with the export of a network.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/firmware/float_blocks.h"
#include "nn/weights/network.h"

namespace swarmcert::firmware {

/// The first number that is not what the network has.
struct Difference {
  std::string part, layer;  ///< "phi:small", "fc1"
  std::string entry;        ///< "weight[3][2]" or "bias[7]"; without index where nothing resembles the array
  float expected = 0;
  std::optional<float> found;  ///< nothing where no numbers of the file resemble the array
  std::string name, place;     ///< variable or symbol, and line or address
};

struct MatchResult {
  bool equal = false;
  int arrays = 0;           ///< weight matrices and bias vectors that were looked for
  std::size_t numbers = 0;  ///< weights and biases in them
  std::optional<Difference> first_difference;
};

/// Looks for every weight matrix, row by row, transposed or in nn::Layout::kBlocks, and every bias vector, as
/// uninterrupted runs of the same bits. A bias must be the variable that goes by its matrix's name with "bias" for
/// "weight"; where nothing has such a name, follow its matrix or, from four numbers on, lie anywhere: fewer numbers are
/// found everywhere.
/// Guarantee: `equal` means that all of them stand in the file bit for bit. Which code reads them is not looked at.
/// Precondition: every weight is a float32 (files::as_float32()).
MatchResult match(const files::Network& network, const std::vector<FloatBlock>& blocks);

}  // namespace swarmcert::firmware

/// @file Converts arrays named by common conventions in .npz and .mat files to the layers of a network.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/weights.h"

namespace swarmcert::files {

struct NamedArray {
  std::string name;
  std::vector<std::uint64_t> shape;
  std::vector<double> numbers;  ///< row-major
  bool is_float32 = false;      ///< stored as float32 or float16
};

/// Builds layers from pairs of names, "fc1.weight" and "fc1.bias", "fc1_weight" and "fc1_bias", "W1" and "b1",
/// "weights_1" and "biases_1", or from NumPy's "arr_0", "arr_1", ..., where each matrix may be followed by its biases.
/// Matrices are [outputs, inputs]; biases may be rows or columns. The numbers in the names order the layers.
/// @throws InputError if an array is neither a weight nor a bias, or as assemble().
Weights network_of_arrays(const std::vector<NamedArray>& arrays, const std::string& path,
                          const LayerChoice& choice);

/// Returns whether every entry of this zip archive is a .npy array.
bool looks_like_npz(const std::string& bytes);

/// Parses the network in an .npz archive written by numpy.savez.
/// @throws InputError as network_of_arrays(), or if the archive or one of its arrays cannot be read.
Weights parse_npz(const std::string& bytes, const std::string& path, const LayerChoice& choice);

}  // namespace swarmcert::files

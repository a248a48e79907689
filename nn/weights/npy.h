/// @file One array of NumPy's .npy format, as the entries of an .npz archive hold it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmcert::files {

struct NpyArray {
  std::vector<std::uint64_t> shape;  ///< no entry: a single number
  std::vector<double> numbers;       ///< row-major
};

/// Reads the format versions 1 to 3; little-endian float32 and float64 in C order, at most kMostElements numbers.
/// Finite or not: the caller decides. `path` and `entry` are for messages.
/// @throws InputError for anything else, and where the header does not fit the length of `bytes`.
NpyArray parse_npy(const std::string& bytes, const std::string& path, const std::string& entry);

}  // namespace swarmcert::files

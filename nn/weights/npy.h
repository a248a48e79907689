/// @file One array of NumPy's .npy format, as the entries of an .npz archive hold it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmcert::files {

struct NpyArray {
  std::vector<std::uint64_t> shape;  ///< empty: a single number
  std::vector<double> numbers;       ///< row-major
  bool is_float32 = false;           ///< stored as float32 or float16
};

/// Parses format versions 1 to 3: little-endian float16, float32 and float64 in C order, at most kMostElements numbers.
/// Numbers may be non-finite; the caller must check. `path` and `entry` are used in messages only.
/// @throws InputError for anything else, and if the header does not match the length of `bytes`.
NpyArray parse_npy(const std::string& bytes, const std::string& path, const std::string& entry);

}  // namespace swarmcert::files

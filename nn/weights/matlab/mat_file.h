/// @file MATLAB's MAT files, versions 5 and 7.3, that hold network weights in the form that LipSDP and ECLipsE use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nn/weights/named_arrays.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

inline constexpr std::size_t kMostCells = 4096;

/// A variable of either version: a numeric array, a cell array or a struct. Text, function handles, sparse matrices,
/// ... are none of the three.
struct MatVariable {
  std::string name;
  std::optional<NamedArray> array;  ///< set for a numeric array
  bool is_cell = false;
  std::vector<NamedArray> cells;  ///< of a cell array of numeric arrays
  bool is_struct = false;         ///< a single struct, not an array of structs
  std::vector<MatVariable> fields;
};

/// What contains a variable. A struct may contain cell arrays, and both may contain numbers.
enum class MatInside { kFile, kStruct, kCell };

/// Converts the column-major numbers of a matrix to row-major; returns the numbers of any other array unchanged.
std::vector<double> rows_first(std::vector<double> columns_first, const std::vector<std::uint64_t>& shape);

/// Returns true if `bytes` begin like a MAT file of version 5 or later.
bool looks_like_mat(const std::string& bytes);

/// Parses the network in `bytes`: a cell array "weights" of matrices [outputs, inputs], optionally with "biases";
/// matrices with names that network_of_arrays() recognizes; or a single struct with such fields. Numeric arrays may be
/// of any class, compressed (-v7, -v7.3) or not (-v6).
/// @throws InputError with the offset for anything else.
Weights parse_mat(const std::string& bytes, const std::string& path, const std::vector<std::string>& order);

}  // namespace swarmcert::files

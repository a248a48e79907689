/// @file MATLAB's MAT files, versions 5 and 7.3, with the weights of a network, as LipSDP and ECLipsE use them.
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

/// A variable of either version. Text, function handles, sparse matrices, ... are none of the three.
struct MatVariable {
  std::string name;
  std::optional<NamedArray> array;  ///< of a numeric one
  bool is_cell = false;
  std::vector<NamedArray> cells;  ///< of a cell array of numeric ones
  bool is_struct = false;         ///< a single one, no array of structs
  std::vector<MatVariable> fields;
};

/// What a variable may lie in: a struct may hold cell arrays, and both may hold numbers.
enum class MatInside { kFile, kStruct, kCell };

/// MATLAB's `columns_first` numbers of a matrix, row by row; those of any other array as they are.
std::vector<double> rows_first(std::vector<double> columns_first, const std::vector<std::uint64_t>& shape);

/// True if `bytes` begin as a MAT file of version 5 or later does.
bool looks_like_mat(const std::string& bytes);

/// The network in `bytes`: a cell array "weights" of matrices [outputs, inputs], with "biases" where there are any; or
/// matrices with names that network_of_arrays() knows; or the only struct with such fields. Numeric arrays of every
/// class, compressed (-v7, -v7.3) or not (-v6).
/// @throws InputError for anything else, with the offset.
Weights parse_mat(const std::string& bytes, const std::string& path, const std::vector<std::string>& order);

}  // namespace swarmcert::files

/// @file The variables of MATLAB's MAT files, versions 5 and 7.3.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nn/weights/named_arrays.h"

namespace swarmcert::files {

inline constexpr std::size_t kMostCells = 4096;
inline constexpr char kSaveAgain[] =
    "save in MATLAB with save('net.mat', 'weights', '-v7'), or with scipy.io.savemat";

/// A variable of either version: a numeric array, a cell array, a struct or text. Function handles, sparse matrices,
/// ... are none of these.
struct MatVariable {
  std::string name;
  std::optional<NamedArray> array;  ///< set for a numeric array
  bool is_cell = false;
  std::vector<NamedArray> cells;   ///< the numeric arrays of a cell array
  std::vector<std::string> texts;  ///< the rows of text, or the texts of a cell array
  bool is_struct = false;          ///< a single struct, not an array of structs
  std::vector<MatVariable> fields;
};

/// What contains a variable. A struct may contain cell arrays, and both may contain numbers.
enum class MatInside { kFile, kStruct, kCell };

/// Converts the column-major numbers of a matrix to row-major; returns the numbers of any other array unchanged.
std::vector<double> rows_first(std::vector<double> columns_first, const std::vector<std::uint64_t>& shape);

/// Returns the rows of text whose characters are stored column by column, without the blanks at their ends.
std::vector<std::string> rows_of_text(const std::vector<double>& units,
                                      const std::vector<std::uint64_t>& shape);

/// Returns true if `bytes` begin like a MAT file of version 5 or later.
bool looks_like_mat(const std::string& bytes);

/// Returns the variables of a file of either version.
/// @throws InputError with the offset if it is damaged.
std::vector<MatVariable> mat_variables(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::files

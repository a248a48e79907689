#include "nn/weights/matlab/mat73.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/hdf5.h"

namespace swarmcert::files {
namespace {

constexpr std::array<std::string_view, 10> kNumeric = {"double", "single", "int8",   "uint8", "int16",
                                                       "uint16", "int32",  "uint32", "int64", "uint64"};

std::vector<MatVariable> variables_of(const Hdf5Object& group, MatInside inside, const std::string& path);

/// MATLAB stores matrices column-major, whereas HDF5 is row-major, so the dimensions are reversed.
NamedArray array_of(const Hdf5Object& object, const std::string& name) {
  if (object.flag("MATLAB_empty")) return {name, {0, 0}, {}, false};
  hdf5::Numbers stored = object.numbers();
  const std::vector<std::uint64_t> shape(stored.shape.rbegin(), stored.shape.rend());
  return {name, shape, rows_first(std::move(stored.numbers), shape), stored.is_float32};
}

MatVariable variable_of(const std::string& name, const Hdf5Object& object, MatInside inside,
                        const std::string& path) {
  const std::vector<std::string> stated = object.texts("MATLAB_class").value_or(std::vector<std::string>());
  const std::string matlab_class = stated.empty() ? "" : stated.front();
  MatVariable result;
  result.name = name;
  if (object.is_group()) {
    result.is_struct = matlab_class == "struct" && inside == MatInside::kFile;
    if (result.is_struct) result.fields = variables_of(object, MatInside::kStruct, path);
  } else if (matlab_class == "cell" && inside != MatInside::kCell) {
    result.is_cell = true;
    if (object.flag("MATLAB_empty")) return result;
    for (const Hdf5Object& target : object.references()) {
      MatVariable cell = variable_of(name, target, MatInside::kCell, path);
      if (!cell.array && cell.texts.size() != 1)
        throw InputError(
            {path, "", in_quotes(name), "", "a cell is neither a numeric array nor text", kSaveAgain});
      if (cell.array) result.cells.push_back(std::move(*cell.array));
      if (!cell.texts.empty()) result.texts.push_back(cell.texts.front());
    }
  } else if (matlab_class == "char") {
    const NamedArray units = array_of(object, name);
    std::vector<std::uint64_t> shape = units.shape;
    std::vector<double> by_columns = rows_first(units.numbers, {shape.size() == 2 ? shape[1] : 0, shape[0]});
    result.texts = rows_of_text(by_columns, shape);
  } else if (std::find(kNumeric.begin(), kNumeric.end(), matlab_class) != kNumeric.end()) {
    result.array = array_of(object, name);
  }
  return result;
}

/// Returns the variables of a group. Names that begin with # are internal to MATLAB: the targets of references.
std::vector<MatVariable> variables_of(const Hdf5Object& group, MatInside inside, const std::string& path) {
  std::vector<MatVariable> result;
  for (const std::string& name : group.links())
    if (name.empty() || name[0] != '#') result.push_back(variable_of(name, group.open(name), inside, path));
  return result;
}

}  // namespace

std::vector<MatVariable> mat73_variables(const std::string& bytes, const std::string& path) {
  return variables_of(hdf5_root(bytes, path), MatInside::kFile, path);
}

}  // namespace swarmcert::files

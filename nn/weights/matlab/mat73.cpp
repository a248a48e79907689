#include "nn/weights/matlab/mat73.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/matlab/hdf5_dataset.h"
#include "nn/weights/matlab/hdf5_group.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::size_t kUserBlock_bytes = 512;
constexpr std::array<std::string_view, 10> kNumeric = {"double", "single", "int8",   "uint8", "int16",
                                                       "uint16", "int32",  "uint32", "int64", "uint64"};
class Mat73Reader {
 public:
  Mat73Reader(const std::string& bytes, const std::string& path)
      : file_(bytes, kUserBlock_bytes, path), path_(path) {}

  std::vector<MatVariable> run() { return variables(file_.object(file_.root()), MatInside::kFile); }

 private:
  /// Returns the variables of a group. Names that begin with # are internal to MATLAB: the targets of references.
  std::vector<MatVariable> variables(const Hdf5Object& group, MatInside inside) {
    std::vector<MatVariable> result;
    for (const Hdf5Link& link : links_of(file_, group))
      if (link.name.empty() || link.name[0] != '#')
        result.push_back(variable(link.name, link.address, inside));
    return result;
  }

  MatVariable variable(const std::string& name, std::uint64_t address, MatInside inside) {
    const Hdf5Object object = file_.object(address);
    const std::string matlab_class = class_of(object);
    MatVariable result;
    result.name = name;
    if (is_group(object)) {
      result.is_struct = matlab_class == "struct" && inside == MatInside::kFile;
      if (result.is_struct) result.fields = variables(object, MatInside::kStruct);
    } else if (matlab_class == "cell" && inside != MatInside::kCell) {
      result.is_cell = true;
      read_cells(object, result);
    } else if (std::find(kNumeric.begin(), kNumeric.end(), matlab_class) != kNumeric.end()) {
      result.array = numbers(object, name);
    }
    return result;
  }

  /// Returns the MATLAB class of the object, or "" if it states none.
  std::string class_of(const Hdf5Object& object) {
    const std::optional<Hdf5Array> text = attribute_of(file_, object, "MATLAB_class");
    if (!text || text->type.type_class != Hdf5Class::kText) return "";
    return text->bytes.substr(0, text->bytes.find('\0'));
  }

  /// Returns whether the array is empty; MATLAB then stores its size in place of its elements.
  bool is_empty(const Hdf5Object& object) {
    const std::optional<Hdf5Array> flag = attribute_of(file_, object, "MATLAB_empty");
    return flag && flag->bytes.find_first_not_of('\0') != std::string::npos;
  }

  void read_cells(const Hdf5Object& object, MatVariable& result) {
    if (is_empty(object)) return;
    const Hdf5Array cells = array_of(file_, object);
    const auto refuse = [&](const std::string& what) {
      throw InputError({path_, "offset " + std::to_string(cells.offset), in_quotes(result.name), "", what,
                        kSaveAsVersion7});
    };
    if (cells.type.type_class != Hdf5Class::kReference) refuse("is a cell array without references");
    if (*element_count(cells.shape) > kMostCells) refuse("has more than 4096 cells");
    for (std::size_t at = 0; at < cells.bytes.size(); at += 8) {
      Hdf5Piece reference(std::string_view(cells.bytes).substr(at, 8), cells.offset, path_);
      MatVariable cell = variable(result.name, reference.number(8), MatInside::kCell);
      if (!cell.array) refuse("cell " + std::to_string(at / 8 + 1) + " is not a numeric array");
      result.cells.push_back(std::move(*cell.array));
    }
  }

  /// MATLAB stores matrices column-major, whereas HDF5 is row-major, so the dimensions are reversed.
  NamedArray numbers(const Hdf5Object& object, const std::string& name) {
    if (is_empty(object)) return {name, {0, 0}, {}, false};
    const Hdf5Array stored = array_of(file_, object);
    const std::vector<std::uint64_t> shape(stored.shape.rbegin(), stored.shape.rend());
    const bool is_float32 = stored.type.type_class == Hdf5Class::kFloat && stored.type.size_bytes == 4;
    return {name, shape, rows_first(numbers_of(stored, name, path_), shape), is_float32};
  }

  Hdf5File file_;
  const std::string& path_;
};

}  // namespace

std::vector<MatVariable> mat73_variables(const std::string& bytes, const std::string& path) {
  return Mat73Reader(bytes, path).run();
}

}  // namespace swarmcert::files

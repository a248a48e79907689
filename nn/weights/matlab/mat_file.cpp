#include "nn/weights/matlab/mat_file.h"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/inflate.h"
#include "nn/weights/matlab/mat73.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

// MATLAB, "MAT-File Format", Level 5: types of data elements and classes of arrays.
constexpr std::uint32_t kInt8 = 1, kUint8 = 2, kInt16 = 3, kUint16 = 4, kInt32 = 5, kUint32 = 6, kSingle = 7,
                        kDouble = 9, kInt64 = 12, kUint64 = 13, kMatrix = 14, kCompressed = 15, kUtf16 = 17;
constexpr std::uint32_t kCellClass = 1, kStructClass = 2, kTextClass = 4, kDoubleClass = 6, kSingleClass = 7,
                        kLastNumericClass = 15;
constexpr std::uint32_t kComplexFlag = 0x800;
constexpr std::size_t kHeader_bytes = 128;
constexpr std::uint64_t kMostDecompressed_bytes = std::uint64_t{1} << 27;

struct MatElement {
  std::uint32_t type = 0;
  std::string_view data;
  std::size_t offset = 0;
};

/// Iterates over consecutive data elements of a piece of the file, or of decompressed data.
class MatElements {
 public:
  MatElements(std::string_view data, std::size_t offset, const std::string& path)
      : data_(data), offset_(offset), path_(path) {}

  bool next(MatElement& element) {
    if (at_ >= data_.size()) return false;
    element.offset = offset_ + at_;
    if (data_.size() - at_ < 8) refuse(element.offset, "an element is truncated");
    const std::uint32_t first = word(at_), second = word(at_ + 4);
    if (first >> 16 != 0) {  // small data element: size and type share a word
      const std::uint32_t size = first >> 16;
      if (size > 4) refuse(element.offset, "a small element has more than 4 bytes");
      element.type = first & 0xffff;
      element.data = data_.substr(at_ + 4, size);
      at_ += 8;
      return true;
    }
    element.type = first;
    if (second > data_.size() - at_ - 8) refuse(element.offset, "an element is longer than its container");
    element.data = data_.substr(at_ + 8, second);
    at_ += 8 + second;
    if (element.type != kCompressed) at_ = std::min(data_.size(), (at_ + 7) / 8 * 8);
    return true;
  }

  MatElement expect(std::uint32_t type, const char* what) {
    MatElement element;
    if (!next(element) || (type != 0 && element.type != type))
      refuse(offset_ + at_, std::string("an array lacks its ") + what);
    return element;
  }

  [[noreturn]] void refuse(std::size_t offset, const std::string& what,
                           const std::string& hint = kCopyAgain) const {
    throw InputError({path_, "offset " + std::to_string(offset), "", "", what, hint});
  }

 private:
  std::uint32_t word(std::size_t at) const {
    std::uint32_t value;
    std::memcpy(&value, data_.data() + at, sizeof value);
    return value;
  }

  std::string_view data_;
  std::size_t offset_;
  const std::string& path_;
  std::size_t at_ = 0;
};

template <typename Stored>
void append_values(std::string_view data, std::vector<double>& numbers) {
  for (std::size_t i = 0; i + sizeof(Stored) <= data.size(); i += sizeof(Stored)) {
    Stored value;
    std::memcpy(&value, data.data() + i, sizeof value);
    numbers.push_back(static_cast<double>(value));
  }
}

class MatReader {
 public:
  MatReader(const std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  std::vector<MatVariable> run() {
    MatElements elements(std::string_view(bytes_).substr(kHeader_bytes), kHeader_bytes, path_);
    std::vector<MatVariable> variables;
    for (MatElement element; elements.next(element);) {
      if (element.type == kCompressed) {
        const std::string inflated = decompressed(element);
        MatElements inner(inflated, element.offset, path_);
        variables.push_back(variable(inner.expect(kMatrix, "contents"), MatInside::kFile));
      } else if (element.type == kMatrix) {
        variables.push_back(variable(element, MatInside::kFile));
      } else {
        elements.refuse(element.offset, "an element is not an array");
      }
      if (variables.size() > kMostCells) elements.refuse(element.offset, "holds too many variables");
    }
    return variables;
  }

 private:
  [[noreturn]] void refuse(std::size_t offset, const std::string& name, const std::string& what,
                           const std::string& hint = kSaveAgain) const {
    throw InputError({path_, "offset " + std::to_string(offset), name, "", what, hint});
  }

  /// Decompresses an element, up to what the largest network needs, whatever size the file claims.
  std::string decompressed(const MatElement& element) {
    std::optional<std::string> result = inflated(element.data, room_bytes_);
    if (!result) refuse(element.offset, "", "its compressed data are damaged", kCopyAgain);
    if (result->size() > room_bytes_)
      refuse(element.offset, "", "decompresses to more than 128 MiB",
             "save without compression: save(..., '-v6')");
    room_bytes_ -= result->size();
    return std::move(*result);
  }

  MatVariable variable(const MatElement& matrix, MatInside inside) {
    MatVariable result;
    if (matrix.data.empty()) return result;
    MatElements parts(matrix.data, matrix.offset + 8, path_);
    const MatElement flags = parts.expect(kUint32, "flags");
    if (flags.data.size() != 8) refuse(flags.offset, "", "the flags of an array are damaged", kCopyAgain);
    std::uint32_t word;
    std::memcpy(&word, flags.data.data(), sizeof word);
    const std::uint32_t array_class = word & 0xff;
    const std::vector<std::uint64_t> shape = sizes(parts.expect(kInt32, "size"));
    result.name = std::string(parts.expect(kInt8, "name").data);
    if (array_class == kCellClass && inside != MatInside::kCell) {
      result.is_cell = true;
      read_cells(parts, shape, result);
    } else if (array_class == kStructClass && inside == MatInside::kFile && *element_count(shape) == 1) {
      result.is_struct = true;
      read_fields(parts, result);
    } else if (array_class == kTextClass && shape.size() == 2) {
      result.texts = rows_of_text(units(parts.expect(0, "text")), shape);
    } else if (array_class >= kDoubleClass && array_class <= kLastNumericClass) {
      if ((word & kComplexFlag) != 0) refuse(matrix.offset, in_quotes(result.name), "holds complex numbers");
      result.array = numbers(parts.expect(0, "numbers"), shape, result.name);
      result.array->is_float32 = array_class == kSingleClass;
    }
    return result;
  }

  std::vector<std::uint64_t> sizes(const MatElement& element) const {
    std::vector<double> stated;
    append_values<std::int32_t>(element.data, stated);
    std::vector<std::uint64_t> shape;
    for (const double size : stated) {
      if (size < 0) refuse(element.offset, "", "a dimension is negative", kCopyAgain);
      shape.push_back(static_cast<std::uint64_t>(size));
    }
    if (shape.size() < 2 || shape.size() > 8 || !element_count(shape))
      refuse(element.offset, "", "an array has too many dimensions or entries");
    return shape;
  }

  void read_cells(MatElements& parts, const std::vector<std::uint64_t>& shape, MatVariable& result) {
    const std::uint64_t count = *element_count(shape);
    if (count > kMostCells) refuse(0, in_quotes(result.name), "has more than 4096 cells");
    for (std::uint64_t k = 0; k < count; ++k) {
      const MatElement element = parts.expect(kMatrix, "cells");
      MatVariable cell = variable(element, MatInside::kCell);
      if (!cell.array && cell.texts.size() != 1)
        refuse(element.offset, in_quotes(result.name),
               "cell " + std::to_string(k + 1) + " is neither a numeric array nor text");
      if (cell.array) result.cells.push_back(std::move(*cell.array));
      if (!cell.array) result.texts.push_back(cell.texts.front());
    }
  }

  /// Returns the units of text, one byte or two each.
  static std::vector<double> units(const MatElement& element) {
    std::vector<double> result;
    if (element.type == kUint16 || element.type == kUtf16) {
      append_values<std::uint16_t>(element.data, result);
    } else {
      append_values<std::uint8_t>(element.data, result);
    }
    return result;
  }

  /// Reads the field names, which all have the same length and are padded with zeros.
  void read_fields(MatElements& parts, MatVariable& result) {
    std::vector<double> lengths;
    append_values<std::int32_t>(parts.expect(kInt32, "length of names").data, lengths);
    const MatElement names = parts.expect(kInt8, "names of fields");
    const auto length = lengths.size() == 1 && lengths[0] >= 1 ? static_cast<std::size_t>(lengths[0]) : 0;
    if (length == 0 || names.data.size() / length > kMostCells)
      refuse(names.offset, in_quotes(result.name), "the names of its fields are damaged", kCopyAgain);
    for (std::size_t at = 0; at + length <= names.data.size(); at += length) {
      MatVariable field = variable(parts.expect(kMatrix, "fields"), MatInside::kStruct);
      const std::string_view name = names.data.substr(at, length);
      field.name = std::string(name.substr(0, name.find('\0')));
      if (field.array) field.array->name = field.name;
      result.fields.push_back(std::move(field));
    }
  }

  NamedArray numbers(const MatElement& element, const std::vector<std::uint64_t>& shape,
                     const std::string& name) const {
    std::vector<double> listed;
    switch (element.type) {
      case kInt8:
        append_values<std::int8_t>(element.data, listed);
        break;
      case kUint8:
        append_values<std::uint8_t>(element.data, listed);
        break;
      case kInt16:
        append_values<std::int16_t>(element.data, listed);
        break;
      case kUint16:
        append_values<std::uint16_t>(element.data, listed);
        break;
      case kInt32:
        append_values<std::int32_t>(element.data, listed);
        break;
      case kUint32:
        append_values<std::uint32_t>(element.data, listed);
        break;
      case kSingle:
        append_values<float>(element.data, listed);
        break;
      case kDouble:
        append_values<double>(element.data, listed);
        break;
      case kInt64:
      case kUint64:
      default:
        refuse(element.offset, in_quotes(name), "holds numbers of an unsupported type");
    }
    if (listed.size() != *element_count(shape))
      refuse(element.offset, in_quotes(name),
             "holds " + std::to_string(listed.size()) + " numbers for the shape " + shape_text(shape),
             kCopyAgain);
    return {name, shape, rows_first(std::move(listed), shape), false};
  }

  const std::string& bytes_;
  const std::string& path_;
  std::uint64_t room_bytes_ = kMostDecompressed_bytes;
};

}  // namespace

std::vector<double> rows_first(std::vector<double> columns_first, const std::vector<std::uint64_t>& shape) {
  if (shape.size() != 2 || columns_first.empty())
    return columns_first;  // avoids a long loop for 2^60 rows and no columns
  std::vector<double> numbers;
  numbers.reserve(columns_first.size());
  for (std::uint64_t i = 0; i < shape[0]; ++i)
    for (std::uint64_t j = 0; j < shape[1]; ++j) numbers.push_back(columns_first[j * shape[0] + i]);
  return numbers;
}

std::vector<std::string> rows_of_text(const std::vector<double>& units,
                                      const std::vector<std::uint64_t>& shape) {
  std::vector<std::string> rows;
  if (units.empty() || shape.size() != 2 || shape[0] == 0 || units.size() % shape[0] != 0) return rows;
  for (std::uint64_t i = 0; i < shape[0]; ++i) {
    rows.emplace_back();
    for (std::size_t k = i; k < units.size(); k += shape[0])
      rows.back() += units[k] < 128 ? static_cast<char>(units[k]) : '?';
    while (!rows.back().empty() && (rows.back().back() == ' ' || rows.back().back() == '\0'))
      rows.back().pop_back();
  }
  return rows;
}

bool looks_like_mat(const std::string& bytes) {
  return bytes.size() >= kHeader_bytes && bytes.compare(0, 7, "MATLAB ") == 0 &&
         (bytes.compare(126, 2, "IM") == 0 || bytes.compare(126, 2, "MI") == 0);
}

std::vector<MatVariable> mat_variables(const std::string& bytes, const std::string& path) {
  if (bytes.compare(126, 2, "IM") != 0)
    throw InputError({path, "offset 126", "", "", "the numbers are not little-endian", kSaveAgain});
  if (bytes.compare(124, 2, std::string("\0\2", 2)) == 0) return mat73_variables(bytes, path);
  if (bytes.compare(124, 2, std::string("\0\1", 2)) != 0)
    throw InputError(
        {path, "offset 124", "", "", "is a MAT file of a version other than 5 and 7.3", kSaveAgain});
  return MatReader(bytes, path).run();
}

}  // namespace swarmcert::files

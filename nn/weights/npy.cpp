#include "nn/weights/npy.h"

#include <cctype>
#include <charconv>
#include <optional>
#include <string_view>

#include "nn/base/input_error.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);
constexpr std::size_t kLongestHeader_bytes = 65'536;
constexpr std::size_t kMostArrayDimensions = 8;

/// Parses the header, a Python literal: {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }.
/// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
class NpyHeader {
 public:
  NpyHeader(std::string_view text, const std::string& path, const std::string& entry)
      : text_(text), path_(path), entry_(entry) {}

  void run() {
    expect('{');
    while (!take('}')) {
      const std::string key = quoted();
      expect(':');
      if (key == "descr") {
        once(!type.empty(), key);
        type = quoted();
      } else if (key == "fortran_order") {
        once(order_.has_value(), key);
        order_ = word();
      } else if (key == "shape") {
        once(has_shape_, key);
        read_shape();
      } else {
        refuse(key, "", "is not a key of a .npy header");
      }
      if (!take(',')) {
        expect('}');
        break;
      }
    }
    skip_blanks();
    if (at_ != text_.size()) refuse("", "", "has text after its header");
    if (type.empty() || !order_ || !has_shape_) refuse("", "", "lacks descr, fortran_order or shape");
    if (*order_ != "False")
      refuse("fortran_order", *order_, "must be False", "numpy.ascontiguousarray(array) before saving");
  }

  std::string type;
  std::vector<std::uint64_t> shape;

 private:
  [[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& what,
                           const std::string& hint = kCopyAgain) const {
    throw InputError({path_, "", entry_ + (key.empty() ? "" : ": " + in_quotes(key)), value, what, hint});
  }

  void once(bool is_known, const std::string& key) const {
    if (is_known) refuse(key, "", "appears twice");
  }

  void skip_blanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }

  bool take(char c) {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  void expect(char c) {
    if (!take(c)) refuse("", "", std::string("expected '") + c + "' in its header");
  }

  std::string quoted() {
    expect('\'');
    const std::size_t end = text_.find('\'', at_);
    if (end == std::string_view::npos) refuse("", "", "has an unterminated string in its header");
    const std::string result(text_.substr(at_, end - at_));
    at_ = end + 1;
    return result;
  }

  std::string word() {
    skip_blanks();
    const std::size_t first = at_;
    while (at_ < text_.size() && std::isalpha(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
    return std::string(text_.substr(first, at_ - first));
  }

  void read_shape() {
    has_shape_ = true;
    expect('(');
    while (!take(')')) {
      skip_blanks();
      std::uint64_t size = 0;
      const char* const end = text_.data() + text_.size();
      const auto [next, error] = std::from_chars(text_.data() + at_, end, size);
      if (error != std::errc()) refuse("shape", "", "is not a list of sizes");
      at_ = static_cast<std::size_t>(next - text_.data());
      shape.push_back(size);
      if (shape.size() > kMostArrayDimensions) refuse("shape", "", "has more than 8 dimensions");
      if (!take(',')) {
        expect(')');
        break;
      }
    }
  }

  std::string_view text_;
  const std::string& path_;
  const std::string& entry_;
  std::size_t at_ = 0;
  std::optional<std::string> order_;
  bool has_shape_ = false;
};

}  // namespace

NpyArray parse_npy(const std::string& bytes, const std::string& path, const std::string& entry) {
  const auto refuse = [&](const std::string& value, const std::string& what, const std::string& hint) {
    throw InputError({path, "", entry, value, what, hint});
  };
  if (bytes.size() < 12 || bytes.compare(0, kMagic.size(), kMagic) != 0)
    refuse("", "is not a .npy array", "save with numpy.savez");
  const int version = static_cast<unsigned char>(bytes[6]);
  if (version < 1 || version > 3) refuse(std::to_string(version), "is an unknown version of .npy", "");
  const std::size_t begin = version == 1 ? 10 : 12;
  std::size_t length = 0;
  for (std::size_t i = begin; i-- > 8;) length = length << 8 | static_cast<unsigned char>(bytes[i]);
  if (length > kLongestHeader_bytes || length > bytes.size() - begin)
    refuse(std::to_string(length) + " bytes", "the header is longer than the array or than 64 KiB",
           kCopyAgain);
  NpyHeader header(std::string_view(bytes).substr(begin, length), path, entry);
  header.run();
  if (header.type != "<f4" && header.type != "<f8" && header.type != "<f2")
    refuse(in_quotes(header.type), "numbers must be little-endian float16, float32 or float64",
           "array.astype(\"float64\") before saving");
  const Precision precision = header.type == "<f4"   ? Precision::kFloat32
                              : header.type == "<f2" ? Precision::kFloat16
                                                     : Precision::kFloat64;
  const std::optional<std::uint64_t> count = element_count(header.shape);
  if (!count)
    refuse(shape_text(header.shape), "has more than " + std::to_string(kMostElements) + " numbers", "");
  const std::size_t data = begin + length;
  if (*count * width(precision) != bytes.size() - data)
    refuse(shape_text(header.shape),
           "does not fit the " + std::to_string(bytes.size() - data) + " bytes of its data", kCopyAgain);
  NpyArray array;
  array.shape = header.shape;
  array.is_float32 = precision != Precision::kFloat64;
  array.numbers.reserve(*count);
  append_numbers(bytes.data() + data, *count, 1, precision, array.numbers);
  return array;
}

}  // namespace swarmcert::files

/// @file Message formats defined by a ULog file, and the offsets of their fields in a record.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {

/// Returns the type called "int8_t", ..., "float", "double", "bool".
std::optional<Scalar> ulog_number(std::string_view type);

/// A number in a record.
struct UlogNumber {
  std::string name;  ///< `q[0]`, `esc[2].rpm`
  Scalar type;
  std::size_t offset;
};
struct UlogLayout {
  std::optional<UlogNumber> timestamp;    ///< microseconds
  std::vector<UlogNumber> numbers;        ///< without the timestamp and padding
  std::vector<std::string> large_arrays;  ///< skipped fields with more than kMostElements elements
  bool has_too_many_columns = false;      ///< more than kMostColumns; `numbers` is truncated there
};
/// Range of sizes of a record: padding at the end of a format need not be logged.
struct UlogSize {
  std::size_t smallest, largest;
};

class UlogFormats {
 public:
  /// Adds a definition as it stands in the file: `name:type field;type field;`. Returns false if it is invalid or
  /// contradicts an earlier one of the same name. A definition may use others that come later.
  bool add(std::string_view definition);
  bool has(const std::string& name) const { return formats_.count(name) > 0; }
  /// Returns the record size; nothing if the format, or one that it uses, is undefined, contains itself, is nested too
  /// deeply, or is larger than a message can be.
  std::optional<UlogSize> size(const std::string& name);
  /// Precondition: size(name) has a value.
  UlogLayout layout(const std::string& name);

 private:
  struct Field {
    std::string name;
    std::optional<Scalar> number;  ///< empty: text or nested
    bool is_text = false;
    std::string nested;
    std::size_t count = 1;
    bool is_array = false;
    std::size_t element_bytes = 0;  ///< set once the format has been measured
    bool is_padding() const { return name.compare(0, 8, "_padding") == 0; }
  };
  struct Format {
    std::string definition;
    std::vector<Field> fields;
    std::size_t next = 0;  ///< the next field to measure
    std::size_t size = 0;  ///< of the fields before `next`
    int nesting = 0;       ///< levels of formats below this one
    bool is_measured = false, is_being_measured = false;
  };

  static std::optional<Field> parse_field(std::string_view text);
  /// Returns the bytes of one element; nothing under the same conditions as size().
  std::optional<std::size_t> element_size(const Field& field, int depth);
  std::optional<std::size_t> measure(const std::string& name, int depth);
  void lay_out(const Format& format, const std::string& prefix, std::size_t offset, UlogLayout& layout);
  void lay_out_element(const Field& field, const std::string& name, std::size_t offset, UlogLayout& layout);

  std::map<std::string, Format> formats_;
};

}  // namespace swarmcert::logs

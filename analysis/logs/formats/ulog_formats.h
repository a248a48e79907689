/// @file Message formats that a ULog file defines, and where their fields lie in a record.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {

/// One number of a record.
struct UlogNumber {
  std::string name;  ///< `q[0]`, `esc[2].rpm`
  Scalar type;
  std::size_t offset;
};
/// One text of a record.
struct UlogText {
  std::string name;
  std::size_t offset, size;
};
struct UlogLayout {
  std::optional<UlogNumber> timestamp;  ///< microseconds
  std::vector<UlogNumber> numbers;      ///< without the time stamp and without padding
  std::vector<UlogText> texts;
  std::vector<std::string> large_arrays;  ///< fields with more than kMostElements elements, left out
  bool has_too_many_columns = false;      ///< more than kMostColumns; `numbers` is cut there
};
/// Sizes that a record may have: padding at the end of a format need not be logged.
struct UlogSize {
  std::size_t smallest, largest;
};

class UlogFormats {
 public:
  /// Definition as it stands in the file: `name:type field;type field;`. False if it is none, or contradicts one of
  /// the same name. A definition may use others that come later.
  bool add(std::string_view definition);
  bool has(const std::string& name) const { return formats_.count(name) > 0; }
  /// Nothing where the format or one that it uses is not defined, uses itself, is nested too deeply, or is larger than
  /// a message can be.
  std::optional<UlogSize> size(const std::string& name);
  /// Precondition: size(name).
  UlogLayout layout(const std::string& name);

 private:
  struct Field {
    std::string name;
    std::optional<Scalar> number;  ///< else text or nested
    bool is_text = false;
    std::string nested;
    std::size_t count = 1;
    bool is_array = false;
    std::size_t element_bytes = 0;  ///< once the format is measured
    bool is_padding() const { return name.compare(0, 8, "_padding") == 0; }
  };
  struct Format {
    std::string definition;
    std::vector<Field> fields;
    std::size_t next = 0;  ///< field to measure
    std::size_t size = 0;  ///< of the fields before `next`
    int nesting = 0;       ///< formats below this one
    bool is_measured = false, is_being_measured = false;
  };

  static std::optional<Field> parse_field(std::string_view text);
  /// Bytes of one element; nothing as size().
  std::optional<std::size_t> element_size(const Field& field, int depth);
  std::optional<std::size_t> measure(const std::string& name, int depth);
  void lay_out(const Format& format, const std::string& prefix, std::size_t offset, UlogLayout& layout);
  void lay_out_element(const Field& field, const std::string& name, std::size_t offset, UlogLayout& layout);

  std::map<std::string, Format> formats_;
};

}  // namespace swarmcert::logs

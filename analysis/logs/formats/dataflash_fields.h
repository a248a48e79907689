/// @file Message formats as defined by an ArduPilot log.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {

inline constexpr std::size_t kDataflashHead_bytes = 3;  ///< of each message: two fixed bytes and the format

/// How a field type, a single letter, is stored.
struct FieldType {
  std::optional<Scalar> number;  ///< empty: text or a 16-bit float
  std::size_t bytes = 0;
  std::size_t count = 1;
  double scale = 1;  ///< factor for the stored value
  bool is_text = false;
};

struct DataflashField {
  std::string name;
  char letter;
  FieldType type;
  std::size_t offset;  ///< from the end of the message's header
  std::string unit;
  bool is_instance = false;
};
struct DataflashFormat {
  std::string name, definition;
  std::size_t bytes = 0;               ///< of a message including its header
  std::vector<DataflashField> fields;  ///< empty if the definition is inconsistent

  const DataflashField* find(const std::string& field) const {
    for (const DataflashField& candidate : fields)
      if (candidate.name == field) return &candidate;
    return nullptr;
  }
};

/// Parses field types ("QBff") and names ("TimeUS,I,AccX,AccY"). Returns nothing if they contradict each other or
/// `bytes`.
std::vector<DataflashField> parse_fields(const std::string& letters, const std::string& names,
                                         std::size_t bytes);

/// Returns the IEEE 754 binary16 number at `bytes`.
double half_float(const char* bytes);

}  // namespace swarmcert::logs

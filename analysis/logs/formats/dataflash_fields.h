/// @file Formats of messages as an ArduPilot log defines them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {

inline constexpr std::size_t kDataflashHead_bytes = 3;  ///< of every message: two fixed bytes and the format

/// How a field's type is stored; the types are single letters.
struct FieldType {
  std::optional<Scalar> number;  ///< else text, or a float of 16 bits
  std::size_t bytes = 0;
  std::size_t count = 1;
  double scale = 1;  ///< of what is stored
  bool is_text = false;
};

struct DataflashField {
  std::string name;
  char letter;
  FieldType type;
  std::size_t offset;  ///< in the message, behind its head
  std::string unit;
  bool is_instance = false;
};
struct DataflashFormat {
  std::string name, definition;
  std::size_t bytes = 0;               ///< of a message with its head
  std::vector<DataflashField> fields;  ///< empty if the definition contradicts itself

  const DataflashField* find(const std::string& field) const {
    for (const DataflashField& candidate : fields)
      if (candidate.name == field) return &candidate;
    return nullptr;
  }
};

/// Fields from letters ("QBff") and names ("TimeUS,I,AccX,AccY"); empty if they do not fit each other and `bytes`.
std::vector<DataflashField> parse_fields(const std::string& letters, const std::string& names,
                                         std::size_t bytes);

/// The number at `bytes` in IEEE 754 binary16.
double half_float(const char* bytes);

}  // namespace swarmcert::logs

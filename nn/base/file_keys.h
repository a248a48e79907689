/// @file Keys of files that people write, described once: what the reader of a table accepts, and the schema.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "nn/base/record.h"

namespace swarmcert::files {

/// A text that is one of `words`.
struct OneOf {
  std::vector<std::string> words = {""};
};
inline void describe(Record& record, const OneOf& one) { record.choice(0, one.words); }

/// One number for all axes, or one for x, y and z.
using NumberOrThree = std::variant<double, std::array<double, 3>>;
using TextOrTexts = std::variant<std::string, std::vector<std::string>>;

class Keys;
/// Describes the keys of one table.
using KeysOfTable = std::function<void(Keys&)>;

/// Describes the keys of one table by their types: double, bool, text, list, array, map, variant, OneOf.
class Keys {
 public:
  explicit Keys(Record& record) : record_(record) {}

  void schema(const std::string& schema) {
    record_.constant("schema", schema, "Name and version of this format.");
  }
  template <class T>
  void must(const std::string& name, const char* meaning, const char* unit = "", const T& like = {}) {
    record_.field(interned(name), like, meaning, unit);
  }
  template <class T>
  void may(const std::string& name, const char* meaning, const char* unit = "", const T& like = {}) {
    record_.may(interned(name), std::optional<T>(like), meaning, unit);
  }
  void must_table(const std::string& name, const char* meaning, const KeysOfTable& table);
  void may_table(const std::string& name, const char* meaning, const KeysOfTable& table);
  /// A list of tables.
  void may_tables(const std::string& name, const char* meaning, const KeysOfTable& table);
  /// A table of tables under names that the file chooses.
  void must_named_tables(const std::string& name, const char* meaning, const KeysOfTable& table);
  void may_named_tables(const std::string& name, const char* meaning, const KeysOfTable& table);

 private:
  Record& record_;
};

/// The shape of a table.
inline Node shape_of_table(const KeysOfTable& table) {
  Node shape;
  Record record(shape, true);
  Keys keys(record);
  table(keys);
  shape.kind = Node::Kind::kFields;  // also without keys
  return shape;
}

/// The keys that its reader knows.
inline std::vector<std::string> key_names(const KeysOfTable& table) {
  return field_names(shape_of_table(table));
}

inline void Keys::must_table(const std::string& name, const char* meaning, const KeysOfTable& table) {
  record_.field(interned(name), shape_of_table(table), meaning);
}
inline void Keys::may_table(const std::string& name, const char* meaning, const KeysOfTable& table) {
  record_.may(interned(name), std::optional(shape_of_table(table)), meaning);
}
inline void Keys::may_tables(const std::string& name, const char* meaning, const KeysOfTable& table) {
  record_.may(interned(name), std::optional(std::vector<Node>{shape_of_table(table)}), meaning);
}
inline void Keys::must_named_tables(const std::string& name, const char* meaning, const KeysOfTable& table) {
  record_.field(interned(name), std::map<std::string, Node>{{"", shape_of_table(table)}}, meaning);
}
inline void Keys::may_named_tables(const std::string& name, const char* meaning, const KeysOfTable& table) {
  record_.may(interned(name), std::optional(std::map<std::string, Node>{{"", shape_of_table(table)}}),
              meaning);
}

}  // namespace swarmcert::files

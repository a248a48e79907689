/// @file Results and files described once. A function describe() names each field of a struct with unit, meaning and
/// guarantee; JSON (to_json), JSON Schema (schema_of) and tables (analysis/report/table.h) are views of what it says.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::files {

/// What a field is. The texts must outlive every view: literals, or interned().
struct About {
  const char* meaning = "";  ///< one sentence or less; what null means, if the field may be null
  const char* unit = "";     ///< as "N", "m/s", "m per N/s"; empty: none, or part of the meaning
  const char* guarantee =
      "";  ///< "exact", "upper bound", "lower bound", "estimate", ...; empty: nothing to say
};

/// Keeps `text` for the life of the process; for meanings that a registry states.
const char* interned(const std::string& text);

/// One described value, or, in a shape, the type of one: lists and maps then have one member, the shape of all.
struct Node {
  enum class Kind : std::uint8_t { kAny, kFlag, kInteger, kNumber, kText, kFields, kList, kMap, kOneOf };

  std::string name;  ///< of the field or map entry; empty in lists
  About about;
  Kind kind = Kind::kAny;
  bool may_be_null = false;
  bool may_be_absent = false;
  std::size_t size = 0;  ///< of a list whose length is part of its type; 0: any length
  /// Scalars only; monostate: null. Numbers that are not finite are null in JSON.
  std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string> value;
  std::vector<std::string> choices;  ///< all values that a text may have; empty: any text
  std::vector<Node> members;         ///< fields in order, elements, entries, or the alternatives of kOneOf

  /// Returns the member at a dotted path ("max.x"); nullptr if there is none.
  const Node* find(std::string_view path) const;
};

/// Writes the description of one value: describe(record, value) calls its member functions.
class Record {
 public:
  /// @param is_shape whether types are recorded instead of values. Lists and maps then hold one element, their first or
  ///     a default one, and optional values are present, whatever they hold.
  Record(Node& node, bool is_shape) : node_(&node), is_shape_(is_shape) {}

  bool is_shape() const { return is_shape_; }

  /// A field that is always there. An empty std::optional, and a number that is not finite, is null.
  template <class T>
  void field(const char* name, const T& value, const char* meaning, const char* unit = "",
             const char* guarantee = "") {
    add(name, {meaning, unit, guarantee}).put(value);
  }

  /// A field that is there only where it applies: left out if `value` is empty.
  template <class T>
  void may(const char* name, const std::optional<T>& value, const char* meaning, const char* unit = "",
           const char* guarantee = "") {
    if (!value && !is_shape_) return;
    Record inner = add(name, {meaning, unit, guarantee});
    inner.node_->may_be_absent = true;
    inner.put(value ? *value : T{});
  }

  /// An object whose fields `describe_fields` describes; left out unless `is_present`.
  void object(const char* name, const char* meaning, const std::function<void(Record&)>& describe_fields);
  void may_object(bool is_present, const char* name, const char* meaning,
                  const std::function<void(Record&)>& describe_fields);
  /// Fields of this object that are there only if `is_present`.
  void may_fields(bool is_present, const std::function<void(Record&)>& describe_fields);
  /// An object, null unless `is_present`.
  void object_or_null(bool is_present, const char* name, const char* meaning,
                      const std::function<void(Record&)>& describe_fields);

  /// A list of objects; `describe_one(record, item)` describes the fields of one.
  template <class T, class Describe>
  void list(const char* name, const std::vector<T>& items, const char* meaning, Describe describe_one) {
    Record all = add(name, {meaning, "", ""});
    all.begin(Node::Kind::kList);
    const auto add_element = [&](const T& item) {
      Record one = all.element();
      one.begin(Node::Kind::kFields);
      describe_one(one, item);
    };
    if (is_shape_) return add_element(T{});
    all.reserve(items.size());
    for (const T& item : items) add_element(item);
  }

  /// A list of objects, null unless `is_present`.
  template <class T, class Describe>
  void list_or_null(bool is_present, const char* name, const std::vector<T>& items, const char* meaning,
                    Describe describe_one) {
    if (is_present || is_shape_)
      list(name, items, meaning, describe_one);
    else
      add(name, {meaning, "", ""});
    node_->members.back().may_be_null = true;
  }

  /// An object with an entry per item, in the order given, whose fields `describe_one(record, item)` describes.
  template <class T, class Describe>
  void entries(const char* name, const std::vector<std::pair<std::string, T>>& items, const char* meaning,
               Describe describe_one) {
    Record all = add(name, {meaning, "", ""});
    all.begin(Node::Kind::kMap);
    const auto add_entry = [&](const std::string& key, const T& item) {
      Record one = all.entry(key);
      one.begin(Node::Kind::kFields);
      describe_one(one, item);
    };
    if (is_shape_) return add_entry("", T{});
    for (const auto& [key, item] : items) add_entry(key, item);
  }

  /// A text that is the same in every result.
  void constant(const char* name, const std::string& text, const char* meaning);

  /// The value itself is a text, one of `names`. For enumerations:
  /// `void describe(Record& r, Loop loop) { r.choice(loop, {"continuous", "sampled"}); }`
  template <class Index>
  void choice(Index index, std::vector<std::string> names) {
    choose(static_cast<std::size_t>(index), std::move(names));
  }

  /// The value itself; field() and may() call it.
  template <class T>
  void put(const T& value) {
    if constexpr (std::is_same_v<T, bool>)
      put_flag(value);
    else if constexpr (std::is_integral_v<T> && std::is_unsigned_v<T>)
      put_unsigned(value);
    else if constexpr (std::is_integral_v<T>)
      put_integer(value);
    else if constexpr (std::is_floating_point_v<T>)
      put_number(value);
    else if constexpr (std::is_convertible_v<T, std::string_view>)
      put_text(value);
    else {
      begin(Node::Kind::kFields);
      describe(*this, value);
    }
  }
  template <class T>
  void put(const std::optional<T>& value) {
    if (value || is_shape_) put(value ? *value : T{});
    node_->may_be_null = true;
  }
  template <class T>
  void put(const std::vector<T>& values) {
    begin(Node::Kind::kList);
    if (is_shape_) return element().put(values.empty() ? T{} : values.front());
    reserve(values.size());
    for (const T& value : values) element().put(value);
  }
  template <class T, std::size_t kN>
  void put(const std::array<T, kN>& values) {
    begin(Node::Kind::kList);
    node_->size = kN;
    if (is_shape_) return element().put(T{});
    for (const T& value : values) element().put(value);
  }
  template <class T>
  void put(const std::map<std::string, T>& entries) {
    begin(Node::Kind::kMap);
    if (is_shape_) return entry("").put(entries.empty() ? T{} : entries.begin()->second);
    for (const auto& [key, value] : entries) entry(key).put(value);
  }
  /// Entries in the order given.
  template <class T>
  void put(const std::vector<std::pair<std::string, T>>& entries) {
    begin(Node::Kind::kMap);
    if (is_shape_) return entry("").put(T{});
    for (const auto& [key, value] : entries) entry(key).put(value);
  }
  template <class... T>
  void put(const std::variant<T...>& value) {
    if (!is_shape_) return std::visit([this](const auto& held) { put(held); }, value);
    begin(Node::Kind::kOneOf);
    (element().put(T{}), ...);
  }
  /// [lower, upper].
  void put(const Interval& value) { put(std::array<double, 2>{value.lower, value.upper}); }
  /// A value that is described elsewhere or may be anything; its shape is any value.
  void put(const nlohmann::ordered_json& json);
  /// A described value, or a shape.
  void put(const Node& node);

 private:
  Record add(const char* name, const About& about);
  Record element();
  Record entry(const std::string& key);
  void begin(Node::Kind kind) { node_->kind = kind; }
  void reserve(std::size_t members) { node_->members.reserve(members); }
  void put_flag(bool value);
  void put_integer(std::int64_t value);
  void put_unsigned(std::uint64_t value);
  void put_number(double value);
  void put_text(std::string_view value);
  void choose(std::size_t index, std::vector<std::string> names);

  Node* node_;
  bool is_shape_;
};

/// Returns `value` as described.
template <class T>
Node record_of(const T& value) {
  Node node;
  Record(node, false).put(value);
  return node;
}

/// Returns the shape of all values of type T, which must have a default value that describe() accepts.
template <class T>
Node shape_of() {
  Node node;
  Record(node, true).put(T{});
  return node;
}

/// Returns the names of the fields of a shape: the keys that a reader of such a file knows.
std::vector<std::string> field_names(const Node& shape);

/// The value as JSON, fields in the order of the description.
nlohmann::ordered_json to_json(const Node& value);

/// Returns the JSON Schema (draft 2020-12) of all values of a shape. Objects hold the described fields, nothing else.
/// @param name of the schema: its $id is urn:swarmcert:schema:NAME:1
/// @param numbers_may_be_null whether numbers may be null (not finite): true for results, false for files that are read
nlohmann::ordered_json schema_of(const Node& shape, const std::string& name, const std::string& title,
                                 const std::string& description, bool numbers_may_be_null);

/// {x, y, z} of the world frame, if the field says nothing else.
struct Axes {
  double x = 0, y = 0, z = 0;
};
void describe(Record& record, const Axes& axes);

/// {x, y, z, total}; total is of the vector.
struct AxesAndTotal {
  double x = 0, y = 0, z = 0, total = 0;
};
void describe(Record& record, const AxesAndTotal& axes);

/// Returns the first three entries of a vector of any library as {x, y, z}.
template <class Vector>
Axes axes(const Vector& v) {
  return {v[0], v[1], v[2]};
}

}  // namespace swarmcert::files

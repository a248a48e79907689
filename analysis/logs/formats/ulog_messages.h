/// @file Messages of a ULog file that are no records: their forms, keys and values.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace swarmcert::logs {

/// Types of the messages that are known here.
inline constexpr std::string_view kUlogTypes = "ABCDFILMOPQRS";

/// A message: type and body, wherever it stands.
struct UlogMessage {
  char type;
  std::string_view body;
};

/// "type name" and the bytes behind, as information and parameters have them.
struct KeyedValue {
  std::string type, name;
  std::string_view value;
};

/// Nothing if `body` has no such key.
std::optional<KeyedValue> keyed_value(std::string_view body);

/// True if the value has as many bytes as its type says; true also for types that are not known here.
bool value_size_fits(const KeyedValue& entry);

/// Nothing if it is neither an int32_t nor a float.
std::optional<double> parameter_of(const KeyedValue& entry);

/// Information as text: characters as they are, numbers in decimal.
std::string text_of(const KeyedValue& entry);

/// True if the body has the form of its type; false for data ('D'), whose form the file defines, and for unknown types.
/// Looks at a few bytes only.
bool has_form(const UlogMessage& message);

}  // namespace swarmcert::logs

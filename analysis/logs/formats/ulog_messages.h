/// @file Messages of a ULog file other than data records: their forms, keys and values.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace swarmcert::logs {

/// The message types known to this reader.
inline constexpr std::string_view kUlogTypes = "ABCDFILMOPQRS";

/// A message: its type and body.
struct UlogMessage {
  char type;
  std::string_view body;
};

/// A key "type name" and the bytes that follow it, as in information and parameter messages.
struct KeyedValue {
  std::string type, name;
  std::string_view value;
};

/// Splits `body` into key and value; returns nothing if it has no such key.
std::optional<KeyedValue> keyed_value(std::string_view body);

/// Returns true if the value has the size that its type requires, or if the type is unknown.
bool value_size_fits(const KeyedValue& entry);

/// Returns the value of a parameter; nothing if it is neither an int32_t nor a float.
std::optional<double> parameter_of(const KeyedValue& entry);

/// Returns information as text: characters verbatim, numbers in decimal.
std::string text_of(const KeyedValue& entry);

/// Returns true if the body has the form required by its type; false for data ('D'), whose form is defined in the file,
/// and for unknown types. Looks at only a few bytes.
bool has_form(const UlogMessage& message);

}  // namespace swarmcert::logs

/// @file Escaping of untrusted text per format, and the number format shared by all outputs.
#pragma once

#include <optional>
#include <string>

namespace swarmcert::gate {

/// Returns valid UTF-8 without control characters; everything else becomes "?".
std::string printable(const std::string& text);

/// Applies printable() and escapes for XML text and double-quoted attributes.
std::string xml(const std::string& text);

/// Applies printable() and escapes for a cell of a Markdown table: no markup, no HTML.
std::string markdown(const std::string& text);

/// Escapes for the message of a GitHub workflow command or, if `is_property`, for the value of one of its properties.
std::string github(const std::string& text, bool is_property);

/// Returns a path as a URI reference (RFC 3986): relative, or file:// for an absolute path.
std::string uri(const std::string& path);

/// Formats six digits; "-" if empty, "not finite" if not finite.
std::string number(const std::optional<double>& value);

}  // namespace swarmcert::gate

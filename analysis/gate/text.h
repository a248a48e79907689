/// @file Escaping of untrusted text per format, and numbers as all formats show them.
#pragma once

#include <optional>
#include <string>

namespace swarmcert::gate {

/// Valid UTF-8 without control characters: whatever else becomes "?".
std::string printable(const std::string& text);

/// printable(), for XML text and attributes in double quotes.
std::string xml(const std::string& text);

/// printable(), for a cell of a Markdown table: no markup, no HTML.
std::string markdown(const std::string& text);

/// For the message of a GitHub workflow command; `is_property`: for the value of one of its properties.
std::string github(const std::string& text, bool is_property);

/// A path as URI reference (RFC 3986): relative, or file:// for an absolute one.
std::string uri(const std::string& path);

/// Six digits; "-" for nothing, "not finite" otherwise.
std::string number(const std::optional<double>& value);

}  // namespace swarmcert::gate

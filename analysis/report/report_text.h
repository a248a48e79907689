/// @file Escaping of user text (names in logs, networks, files) for the languages of a report.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::analysis {

/// Escapes `text` for HTML, both between tags and in quoted attributes. Bytes that are not valid UTF-8, and control
/// characters, become U+FFFD.
std::string html_text(const std::string& text);

/// Makes JSON safe inside an HTML script element: no "<" is left, so neither "</script>" nor "<!--" can occur.
std::string script_json(std::string json);

/// Returns `text` as one quoted field of a gnuplot data file, including the quotes; it cannot end the field or its
/// line, or start an escape. Quotes become primes, backslashes become slashes, control characters become spaces; the
/// middle of long names is left out.
std::string plot_field(const std::string& text);

/// Returns `text` as a single-quoted gnuplot string, in which nothing is expanded. Quotes become typographic quotes,
/// because gnuplot accepts '' inside a string but not at its start.
std::string plot_string(const std::string& text);

/// Returns the bytes in base64.
std::string base64(std::string_view bytes);

/// Returns `words` as a line that a POSIX shell parses back into the same words.
std::string shell_line(const std::vector<std::string>& words);

}  // namespace swarmcert::analysis

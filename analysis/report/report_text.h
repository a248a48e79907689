/// @file Escaping of users' text (names in logs, networks, files) for the languages of a report.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::analysis {

/// `text` for HTML, between tags and in quoted attributes. Bytes that are not UTF-8, and control characters, become
/// U+FFFD.
std::string html_text(const std::string& text);

/// JSON that may stand in an HTML script element: no "<" is left in it, so neither "</script>" nor "<!--" can occur.
std::string script_json(std::string json);

/// `text` as one quoted field of a gnuplot data file, quotes included: it cannot end the field, its line or begin an
/// escape. Quotes become primes, backslashes slashes, control characters spaces; long names lose their middle.
std::string plot_field(const std::string& text);

/// `text` as a gnuplot string in single quotes, in which nothing is expanded. Quotes become typographic ones: gnuplot
/// understands '' within a string, but not at its start.
std::string plot_string(const std::string& text);

/// `words` as a line that a POSIX shell reads back as the same words.
std::string shell_line(const std::vector<std::string>& words);

}  // namespace swarmcert::analysis

/// @file Small operations on text: ends and separated lists.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::files {

/// Whether `text` ends with `ending`; true if both are equal or `ending` is empty.
inline bool ends_with(std::string_view text, std::string_view ending) {
  return text.size() >= ending.size() && text.substr(text.size() - ending.size()) == ending;
}

/// Returns the parts of `text` between separators: "a,,b" has an empty one, "a," and "" have none after the last.
inline std::vector<std::string> split_at(std::string_view text, std::string_view separator) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = text.find(separator);
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + separator.size());
  }
  return parts;
}
inline std::vector<std::string> split_at_commas(std::string_view text) { return split_at(text, ","); }

}  // namespace swarmcert::files

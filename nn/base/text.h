/// @file Small operations on text: ends and comma-separated lists.
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

/// Returns the parts of `text` between commas: "a,,b" has an empty one, "a," and "" have none after the comma.
inline std::vector<std::string> split_at_commas(std::string_view text) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = text.find(',');
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return parts;
}

}  // namespace swarmcert::files

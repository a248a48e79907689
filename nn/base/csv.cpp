#include "nn/base/csv.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace swarmcert::files {

std::string_view without_blanks(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\"";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

char csv_separator(std::string_view line, char otherwise) {
  for (const char separator : {',', ';', '\t'}) {
    bool in_quotes = false;
    for (const char c : line) {
      in_quotes ^= c == '"';
      if (c == separator && !in_quotes) return separator;
    }
  }
  return otherwise;
}

std::vector<std::string_view> csv_cells(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    // Separators between quotes belong to the cell.
    const std::size_t first = line.find_first_not_of(' ', begin);
    const bool is_quoted = first < line.size() && line[first] == '"';
    const std::size_t end =
        std::min(line.find(separator, is_quoted ? line.find('"', first + 1) : begin), line.size());
    const std::string_view cell = without_blanks(line.substr(begin, end - begin));
    if (separator != ' ' || !cell.empty()) cells.push_back(cell);
    begin = end + 1;
  }
  return cells;
}

bool csv_number(std::string_view cell, double& value) {
  if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool is_out_of_range = error == std::errc::result_out_of_range;
  if (is_out_of_range) value = std::numeric_limits<double>::infinity();
  return (error == std::errc() || is_out_of_range) && end == cell.data() + cell.size() && !cell.empty();
}

}  // namespace swarmcert::files

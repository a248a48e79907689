/// @file Parsing of delimited text tables: separators, cells, numbers.
#pragma once

#include <string_view>
#include <vector>

namespace swarmcert::files {

/// Returns `text` without leading and trailing blanks, carriage returns and double quotes.
std::string_view without_blanks(std::string_view text);

/// Returns the first of comma, semicolon and tab, in this order of preference, that `line` contains outside of quotes;
/// else `otherwise`.
char csv_separator(std::string_view line, char otherwise);

/// Returns the cells of `line`, without blanks and quotes around them. With separator ' ', runs of blanks count once.
std::vector<std::string_view> csv_cells(std::string_view line, char separator);

/// Parses a cell. Returns true if the whole cell is a number, including "nan" and "inf"; a leading '+' is allowed.
/// Numbers beyond the range of double become infinite.
bool csv_number(std::string_view cell, double& value);

}  // namespace swarmcert::files

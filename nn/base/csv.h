/// @file Lines of tables in text files: separators, cells, numbers.
#pragma once

#include <string_view>
#include <vector>

namespace swarmcert::files {

/// `text` without the blanks, carriage returns and double quotes at its ends.
std::string_view without_blanks(std::string_view text);

/// The first of comma, semicolon and tab, in this order, that `line` contains; else `otherwise`.
char csv_separator(std::string_view line, char otherwise);

/// The cells of `line`, each without blanks and quotes around it. Runs of blanks count as one where ' ' separates.
std::vector<std::string_view> csv_cells(std::string_view line, char separator);

/// True if the whole cell is a number, "nan" and "inf" among them; '+' may stand in front. A number that a double
/// cannot hold becomes infinite.
bool csv_number(std::string_view cell, double& value);

}  // namespace swarmcert::files

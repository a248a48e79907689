/// @file Tables of records as text.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/raw_log.h"
#include "analysis/logs/signals.h"

namespace swarmcert::logs {

/// The line with the column names: the first line that is no comment or, if that is a record, the comment before it
/// with as many cells or more. It may itself start with "#".
struct TableHeader {
  std::size_t begin = 0, end = 0;  ///< of its line in the text, with the line end
  std::size_t line = 0;            ///< its number, from 1
  char separator = ',';  ///< the first of comma, semicolon and tab that occurs in it; else `otherwise`
  std::vector<std::string_view> names;
};
/// Returns the header of `text`, or std::nullopt if it has none.
std::optional<TableHeader> header_of(std::string_view text, char otherwise);

/// Returns the line that starts at `at` without its end, and moves `at` behind it: to text.size() + 1 if the text ends
/// within the line. Returns an empty line where nothing is left.
std::string_view take_text_line(std::string_view text, std::size_t& at);

/// Reads a table: one topic, or one for each block of columns. After the header come lines with the same number of
/// cells, separated as in the header or, without a separator, by blanks. Cells are numbers or empty; cells that hold a
/// list become columns name[0], name[1], ...; columns that carry no signal may hold anything.
/// Without a header, columns are called "column 1", "column 2", ...; nanoseconds after a column of whole seconds are
/// added to it. If the separator is not a
/// comma, commas are decimal points. Dates become seconds since 1970, times of day seconds since midnight.
/// @throws files::InputError if the header is empty or contains a name twice, if no line can be read, and if no column
///   can be the time.
RawLog read_table(std::istream& in, const std::string& path, const SignalMap& map);

}  // namespace swarmcert::logs

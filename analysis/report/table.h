/// @file Tables of described results (nn/base/record.h), for the terminal and for pages. Heads carry the unit that the
/// description states; a run shows each quantity in one unit.
#pragma once

#include <string>
#include <vector>

#include "nn/base/record.h"

namespace swarmcert::analysis {

/// The unit in which a run shows forces. Results are in newton; only views convert.
struct ForceScale {
  std::string unit = "N";  ///< "N", "mN", "gf" or, for forces per mass, "m/s^2"
  double size_N = 1;       ///< of one such unit
};

struct Column {
  const char* path;         ///< of a field of a row, as in "max.x"; "max.x?": left out if no row has it
  const char* head = "";    ///< empty: the name of the field
  const char* format = "";  ///< of numbers, as in "{:.4f}"; empty: four significant digits
  double factor = 1;        ///< "%" as unit and 100 here: a share
  const char* unit = "";    ///< with `factor`; empty: the described unit
};

struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};

/// Returns one row per element of a described list, or per entry of a map, whose name is the path "".
/// @throws std::logic_error if no row has a field of the path of a column.
Table table(const files::Node& list, const std::vector<Column>& columns, const ForceScale& forces = {});

/// Returns one row per path: name, value with its unit. Fields that are absent are left out.
Table fields_table(const files::Node& record, const std::vector<Column>& rows, const ForceScale& forces = {});

/// Returns a table as lines with aligned columns, numbers to the right, each line indented by two spaces.
std::string to_text(const Table& table);

/// Returns a described value as people read it: "-" for null, "yes", "no", members of a list after one another, those
/// of a map with their names.
std::string cell(const files::Node& value, const char* format = "", double factor = 1);

/// Returns the factor from the described unit, such as "N/s", to the one that is shown, and that unit's name.
/// Units without newton as a factor of their own ("m", "N m", "m per N/s") stay.
std::pair<double, std::string> shown_unit(const std::string& unit, const ForceScale& forces);

}  // namespace swarmcert::analysis

/// @file Names of columns in the forms in which they are compared.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::logs {

/// Returns the name in lower case, without a unit in brackets, with each run of other characters than letters and
/// digits replaced by a dot.
std::string plain_name(const std::string& column);

/// The unit that the name of a column states.
struct StatedUnit {
  std::string unit;   ///< spelled as in columns.toml; empty if there is no known unit
  std::string plain;  ///< plain_name() without the unit after the last word
};

/// Returns the unit in brackets, "vx (mm/s)", or after the last word, "vx_mm_s", "pos_x_m", "roll_deg", "acc_z_mps2".
StatedUnit stated_unit(const std::string& column);

/// Returns the names under which a column with the plain name `column` is looked up: the name itself and the name
/// without its first word, unless that word marks a setpoint. "att.stateestimate.qx" is also found as
/// "stateestimate.qx".
std::vector<std::string> called_names(const std::string& column);

}  // namespace swarmcert::logs

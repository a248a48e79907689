/// @file The names under which known programs log their signals.
///
/// Each name is one line of the table in column_names.cpp. Formats with their own messages (PX4, ROS, ArduPilot) are
/// first converted to the names of columns.toml (message_frames.h), so that each signal is interpreted in one place.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/logs/signals.h"

namespace swarmcert::logs {

/// What the names leave open and the data must decide.
enum class Ask {
  kNothing,
  kMotors,        ///< requested thrust or applied duty; scale
  kVelocityFrame  ///< along the axes of the world or of the body
};

/// Where names come from.
enum class Origin {
  kOwn,         ///< columns.toml; message_frames.h converts messages of known firmware to them
  kPrograms,    ///< known programs: specific enough to be found after another first word
  kMessages,    ///< fields of ROS messages: only in topics of a known type
  kUnits,       ///< names that state what they are: only as they are
  kCommonWords  ///< of the Crazyflie firmware, but common words: only beside its other names
};

/// Columns of one topic that together carry a group of signals, starting with `signal`.
struct NamedColumns {
  int signal;
  std::vector<std::string> names;  ///< as returned by plain_name(), or verbatim if they contain a bracket
  std::string unit;
  double multiply = 1, divide = 1;
  Ask ask = Ask::kNothing;
  Origin origin = Origin::kPrograms;
  std::array<double, 4> sign{1, 1, 1, 1};
};

/// Returns the table, in order of preference: if several rows give the same signal, the first one in the file is used.
const std::vector<NamedColumns>& column_names();

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

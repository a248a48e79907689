/// @file The names under which known programs log their signals.
///
/// A name is one line of the table in column_names.cpp. Formats with messages of their own (PX4, ROS, ArduPilot) are
/// first brought to the names of columns.toml (message_frames.h), so that every signal has its meaning in one place.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/signals.h"

namespace swarmcert::logs {

/// What is still to be decided from the data where names do not say it.
enum class Ask {
  kNothing,
  kAcceleration,   ///< unit, frame, and whether gravity is in it
  kAngles,         ///< degrees or radians, and the signs
  kLegacyPitch,    ///< nothing: the second component has the opposite sign of the rotation about y
  kRates,          ///< degrees or radians per second
  kQuaternion,     ///< x, y, z, w or w, x, y, z
  kMotors,         ///< requested thrust or applied duty; scale
  kVelocityFrame,  ///< along the axes of the world or of the body
  kNorthEastDown,  ///< nothing: north, east, down, beside which body axes are forward, right, down
  kEastNorthUp     ///< nothing
};

/// Columns of one topic that together carry a group of signals, from `signal` on.
struct NamedColumns {
  int signal;
  std::vector<std::string>
      names;  ///< as plain_name() gives them, or as they stand in the file where they hold a bracket
  std::string unit;
  double multiply = 1, divide = 1;
  Ask ask = Ask::kNothing;
};

/// In order of preference: where several rows give one signal, the first that the file has is taken.
const std::vector<NamedColumns>& column_names();

/// Lower case, one dot for every run of other characters than letters and digits, without a unit in brackets.
std::string plain_name(const std::string& column);

/// The names under which a column of plain name `column` is found: itself and, behind one further word that does not
/// turn it into a set point, the rest: "att.stateestimate.qx" is also called "stateestimate.qx".
std::vector<std::string> called_names(const std::string& column);

}  // namespace swarmcert::logs

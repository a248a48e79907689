/// @file What known programs call their signals: the files in dictionary/, which are embedded in the tool.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "analysis/logs/signals.h"
#include "nn/base/toml.h"

namespace swarmcert::logs {

/// Returns the files in order of preference: name and text.
const std::vector<std::pair<std::string, std::string>>& dictionary_files();

/// Returns the text of one file, e.g. "ros_messages.msg".
const std::string& dictionary_text(const std::string& file);

/// Returns a TOML file of the dictionary.
files::TomlTable dictionary_table(const std::string& file);

/// Returns a list of words.toml, in its order: "wish", "foreign", "neutral", "clock", "vehicle".
const std::vector<std::string>& words_of_kind(const std::string& kind);
bool is_word_of(const std::string& kind, const std::string& word);

/// A unit of signals.toml; see UnitFactor.
struct Unit {
  std::string name;
  UnitFactor factor;
};

/// A signal of signals.toml, all parts of it.
struct SignalKind {
  int first;                         ///< of enum Signal
  std::string name;                  ///< in the other files of the dictionary
  std::vector<std::string> columns;  ///< one per part, as in columns.toml
  std::vector<Unit> units;
  std::vector<std::string> frames;  ///< that columns.toml may state
  bool is_command = false;          ///< zero is a value, and topics of set points have it
  bool may_be_partial = false;      ///< a vertical velocity alone is useful, half a quaternion is not
};
const std::vector<SignalKind>& signal_kinds();
/// Returns the kind to which a signal belongs.
const SignalKind& kind_of_signal(int signal);

/// What the names leave open and the data must decide.
enum class Ask {
  kNothing,
  kMotors,        ///< requested thrust or applied duty
  kVelocityFrame  ///< along the axes of the world or of the body
};

/// Where names come from.
enum class Origin {
  kOwn,          ///< columns.toml; message_frames.h converts messages of known firmware to them
  kPrograms,     ///< known programs: specific enough to be found after another first word
  kMessages,     ///< fields of ROS messages: only in topics of a known type
  kStated,       ///< names that state what they are: only as they are
  kCommonWords,  ///< of a program, but common words: only beside its other names
  kFirmware      ///< fields of the messages of PX4 or ArduPilot, which become columns of kOwn
};

/// Columns of one topic that together carry a group of signals, starting with `signal`.
struct NamedColumns {
  int signal = 0;
  std::vector<std::string> names;  ///< as returned by plain_name(), or verbatim if they contain a bracket
  std::string unit;
  UnitFactor factor;
  Ask ask = Ask::kNothing;
  Origin origin = Origin::kPrograms;
  std::array<double, 4> sign{1, 1, 1, 1};
  // Of kFirmware: names are verbatim.
  std::string program, message;
  std::string instead_of;  ///< the message is used if the log does not have this one
  std::string functions;   ///< parameter with the function of output '#'; empty: outputs are in order
  int first_function = 0;  ///< of motor 1
  std::vector<std::string> limits;  ///< parameters with the ends of the range of the outputs
};

/// Returns the rows of all files, in order of preference: if several give the same signal, the first one in a log is
/// used.
const std::vector<NamedColumns>& column_names();

/// What holds if a column of a message, or a parameter, has a value within a range, or a message of the log begins with
/// a text.
struct Sign {
  std::string message, column, parameter, text;
  double least = 0, most = 0;
  std::string means;            ///< "landed", "armed", "valid"; or what the vehicle is
  std::vector<std::string> of;  ///< columns that are valid

  bool is_within(double value) const { return value >= least && value <= most; }
};
const std::vector<Sign>& signs_of_state();
const std::vector<Sign>& signs_of_vehicle();

/// Returns what to write into the configuration of the logger of a program, "crazyflie", to log a signal.
std::string line_that_logs(const std::string& program, const std::string& signal);

}  // namespace swarmcert::logs

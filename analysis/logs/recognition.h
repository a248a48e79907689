/// @file Finds the columns of a log that carry known signals.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "analysis/logs/dictionary.h"
#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// A group of signals carried by columns of one topic.
struct Carried {
  int signal = 0;            ///< the first signal of the group
  std::size_t topic = 0;     ///< index into RawLog::topics
  std::vector<int> columns;  ///< index into RawTopic::columns, one per signal of the group; -1: missing
  std::string unit;
  UnitFactor factor{};
  Ask ask = Ask::kNothing;
  std::array<double, 4> sign{1, 1, 1, 1};  ///< of the columns of vectors and quaternions
  /// Evidence for this reading over `runner_up` if it was found by assignment.h; NaN: the names are known.
  double odds_bits = std::numeric_limits<double>::quiet_NaN();
  std::string runner_up{};

  std::size_t size() const { return columns.size(); }
};

struct Recognition {
  std::vector<Carried> groups;        ///< at most one per first signal
  std::size_t clock = 0;              ///< the topic whose records become samples
  std::vector<std::string> rejected;  ///< groups with dead values or several possible meanings, in words
  /// Units that the values show, also where the motion contradicts known names, in words.
  std::vector<std::string> decided;

  const Carried* find(int signal) const;
  Carried* find(int signal) { return const_cast<Carried*>(std::as_const(*this).find(signal)); }
};

/// Recognises columns by the names of known programs and then by evidence (assignment.h), or by `map` if it is not
/// empty. Dead groups (only zeros or NaN, quaternions without unit norm) are ignored.
/// @throws files::InputError if `map` names a column that no topic has.
Recognition recognise(const RawLog& log, const SignalMap& map);

/// Returns whether rates and the command of each motor were found, from which torques can be judged.
bool has_torque_signals(const Recognition& recognition);

/// Returns whether no column holds a number other than zero.
bool is_dead(const RawTopic& topic, const Carried& carried);

/// Returns whether most records with numbers are unit quaternions.
bool is_unit_quaternion(const RawTopic& topic, const std::vector<int>& columns);

/// q and -q are the same rotation: returns signs with which neighbouring records are close and can be averaged.
std::vector<double> continuous_signs(const RawTopic& topic, const std::vector<int>& columns);

/// Returns what `recognition` says of each column, as a columns.toml would. Accelerations without gravity, which
/// nothing uses, have no name there.
SignalMap meaning_of(const RawLog& log, const Recognition& recognition);

/// Returns the names of the columns, e.g. "ctrlLee.rpyx, ctrlLee.rpyy, ctrlLee.rpyz".
std::string names_of(const RawLog& log, const Carried& carried);

}  // namespace swarmcert::logs

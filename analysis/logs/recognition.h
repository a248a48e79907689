/// @file Which columns of a log carry which signals.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/logs/column_names.h"
#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// A group of signals that columns of one topic carry.
struct Carried {
  int signal = 0;            ///< the first of the group
  std::size_t topic = 0;     ///< index into RawLog::topics
  std::vector<int> columns;  ///< index into RawTopic::columns, one per signal of the group; -1: missing
  std::string unit;
  double multiply = 1, divide = 1;
  Ask ask = Ask::kNothing;

  std::size_t size() const { return columns.size(); }
};

struct Recognition {
  std::vector<Carried> groups;        ///< at most one per first signal
  std::size_t clock = 0;              ///< the topic whose records become samples
  std::vector<std::string> rejected;  ///< groups whose names are known and whose values are dead, in words

  const Carried* find(int signal) const;
};

/// Recognises columns by name, or by `map` where it is not empty. Groups that are dead (nothing but zeros or NaN,
/// quaternions without unit norm) are passed over.
/// @throws files::InputError if `map` names a column that no topic has.
Recognition recognise(const RawLog& log, const SignalMap& map);

/// The column that holds the times of a topic in microseconds, with its scale; columns = {-1} if none does: then
/// RawTopic::time_s counts.
Carried time_column(const RawTopic& topic, const SignalMap& map);

/// "ctrlLee.rpyx, ctrlLee.rpyy, ctrlLee.rpyz"
std::string names_of(const RawLog& log, const Carried& carried);

}  // namespace swarmcert::logs

/// @file Invariants of each RawLog, whatever the file was.
#pragma once

#include <cmath>
#include <set>
#include <string>

#include "analysis/logs/raw_log.h"

namespace swarmcert::tests {

/// Describes the first invariant that `log` violates; empty if it satisfies them all.
inline std::string broken_rule(const logs::RawLog& log) {
  if (log.format.empty()) return "the format has no name";
  std::set<std::pair<std::string, int>> names;
  for (const logs::RawTopic& topic : log.topics) {
    if (!names.emplace(topic.name, topic.instance).second) return "two topics of one name: " + topic.name;
    if (topic.time_s.empty()) return "a topic without a record: " + topic.name;
    std::set<std::string> columns;
    for (const logs::RawColumn& column : topic.columns) {
      if (column.values.size() != topic.time_s.size()) return "not a value per time: " + column.name;
      if (!columns.insert(column.name).second) return "two columns of one name: " + column.name;
    }
  }
  if (!(log.health.dropouts_s >= 0)) return "a dropout of negative duration";
  for (const logs::LeftOut& skip : log.left_out)
    if (skip.name.empty() || skip.why.empty()) return "something left out without name or reason";
  return "";
}

}  // namespace swarmcert::tests

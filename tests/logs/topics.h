/// @file Access to the topics of a RawLog.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::tests {

/// Returns the topic; if there is none, an empty one and a test failure. Valid as long as `log`.
inline const logs::RawTopic& topic_of(const logs::RawLog& log, const std::string& name, int instance = 0) {
  for (const logs::RawTopic& candidate : log.topics)
    if (candidate.name == name && candidate.instance == instance) return candidate;
  static const logs::RawTopic none;
  ADD_FAILURE() << "no topic " << name << " " << instance;
  return none;
}

inline std::vector<double> values_of(const logs::RawTopic& topic, const std::string& column) {
  const logs::RawColumn* const found = topic.find(column);
  return found == nullptr ? std::vector<double>{} : found->values;
}

/// Like values_of() for the log's first topic of that name; empty if there is none.
inline std::vector<double> values_in(const logs::RawLog& log, const std::string& topic,
                                     const std::string& column) {
  for (const logs::RawTopic& candidate : log.topics)
    if (candidate.name == topic) return values_of(candidate, column);
  return {};
}

inline std::vector<std::string> column_names(const logs::RawTopic& topic) {
  std::vector<std::string> names;
  for (const logs::RawColumn& column : topic.columns) names.push_back(column.name);
  return names;
}

/// Returns first, first + 1, ..., last - 1.
inline std::vector<double> range(int first, int last) {
  std::vector<double> numbers;
  for (int k = first; k < last; ++k) numbers.push_back(k);
  return numbers;
}

inline std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace swarmcert::tests

#include "analysis/logs/column_groups.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "analysis/logs/message_frames.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/text.h"

namespace swarmcert::logs {
namespace {

/// Reads a name beside the others of its table: "x_r" is the set point of "x". Alone, an r is as often a radius, a
/// rate or a right motor.
NameReading read_beside(const std::vector<RawColumn>& columns, const std::string& name) {
  if (!files::ends_with(name, "_r")) return read_name(name);
  const std::string measured = name.substr(0, name.size() - 2);
  const bool is_set_point = std::any_of(columns.begin(), columns.end(),
                                        [&](const RawColumn& column) { return column.name == measured; });
  return read_name(is_set_point ? measured + "_ref" : name);
}

class Grouping {
 public:
  Grouping(const RawLog& log, std::size_t topic, const std::vector<char>& taken)
      : topic_(topic), grouped_(log.topics[topic].columns.size(), 0) {
    const std::vector<RawColumn>& columns = log.topics[topic].columns;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      readings_.push_back(read_beside(columns, columns[c].name));
      if (taken[c] != 0 || (!columns[c].values.empty() && !holds_numbers(columns[c].values))) {
        grouped_[c] = 1;
        continue;
      }
      const NameReading& name = readings_[c];
      if (name.kind == IndexKind::kNone) continue;
      // "x" and "x_mm" may stand beside each other.
      const int kind = static_cast<int>(name.kind), column = static_cast<int>(c);
      if (!families_[{name.family, kind}].emplace(name.index, column).second)
        families_[{name.family + " in " + name.unit, kind}].emplace(name.index, column);
    }
  }

  std::vector<ColumnGroup> groups() {
    for (const auto& [key, members] : families_) add_family(static_cast<IndexKind>(key.second), members);
    for (std::size_t c = 0; c < readings_.size(); ++c)
      if (grouped_[c] == 0 && readings_[c].bits[kIsBattery] > 0) add({static_cast<int>(c)}, IndexKind::kAxis);
    add_neighbours(3);
    add_neighbours(4);
    return std::move(groups_);
  }

 private:
  using Members = std::map<int, int>;  // column by index

  void add(std::vector<int> columns, IndexKind kind, bool is_east_north_up = false) {
    ColumnGroup group;
    group.topic = topic_;
    group.columns = std::move(columns);
    group.kind = kind;
    group.is_east_north_up = is_east_north_up;
    group.bits.fill(INFINITY);
    bool is_first = true;
    for (const int c : group.columns) {
      if (c < 0) continue;
      const NameReading& name = readings_[static_cast<std::size_t>(c)];
      if (kind != IndexKind::kNone) grouped_[static_cast<std::size_t>(c)] = 1;
      for (std::size_t q = 0; q < group.bits.size(); ++q)
        group.bits[q] = std::min(group.bits[q], name.bits[q]);
      group.unit = is_first || group.unit == name.unit ? name.unit : kMixedUnits;
      group.is_foreign = group.is_foreign || name.is_foreign;
      group.is_wish = group.is_wish || name.is_wish;
      group.says_down = group.says_down || name.says_down;
      group.says_up = group.says_up || name.says_up;
      is_first = false;
    }
    groups_.push_back(std::move(group));
  }

  static int at(const Members& members, int index) {
    const auto found = members.find(index);
    return found == members.end() ? -1 : found->second;
  }
  static std::vector<int> run(const Members& members, int first, int count) {
    std::vector<int> columns;
    for (int k = first; k < first + count; ++k) columns.push_back(at(members, k));
    return columns;
  }

  void add_family(IndexKind kind, const Members& members) {
    if (kind == IndexKind::kNumber) return add_numbered(members);
    const bool is_compass = kind == IndexKind::kCompass,
               is_four = kind == IndexKind::kAxis && members.size() == 4;
    if (is_compass && members.count(2) == 0) {
      if (members.size() > 1) add({at(members, 1), at(members, 0), at(members, 3)}, kind, true);
      return;
    }
    const bool is_quaternion =
        is_four && readings_[static_cast<std::size_t>(members.at(0))].bits[kIsQuaternion] >= 0;
    const bool is_part_of_rates = kind == IndexKind::kRate && members.size() != 3;
    if (!is_quaternion && !is_part_of_rates) add(run(members, 0, 3), kind);
    if (is_four) add(run(members, 0, 4), kind);
  }

  /// An array counts from 0 or from 1. A longer run of numbers is no vector: its names say nothing.
  void add_numbered(const Members& members) {
    const int first = members.begin()->first, count = static_cast<int>(members.size());
    const bool is_run = first <= 1 && members.rbegin()->first == first + count - 1;
    if (is_run && count >= 3 && count <= 8) add(run(members, first, count), IndexKind::kNumber);
  }

  void add_neighbours(std::size_t count) {
    for (std::size_t c = 0; c + count <= readings_.size(); ++c) {
      std::vector<int> columns;
      while (columns.size() < count && grouped_[c + columns.size()] == 0)
        columns.push_back(static_cast<int>(c + columns.size()));
      if (columns.size() == count) add(std::move(columns), IndexKind::kNone);
    }
  }

  std::size_t topic_;
  std::vector<char> grouped_;
  std::vector<NameReading> readings_;
  std::map<std::pair<std::string, int>, Members> families_;
  std::vector<ColumnGroup> groups_;
};

}  // namespace

bool is_plain_table(const RawLog& log, const RawTopic& topic) {
  return topic.type.empty() && firmware_of(log, topic).empty();
}

std::vector<ColumnGroup> column_groups(const RawLog& log, const std::vector<std::vector<char>>& taken) {
  std::vector<ColumnGroup> groups;
  for (std::size_t t = 0; t < log.topics.size(); ++t) {
    if (!is_plain_table(log, log.topics[t])) continue;
    for (ColumnGroup& group : Grouping(log, t, taken[t]).groups()) groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace swarmcert::logs

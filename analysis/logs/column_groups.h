/// @file Columns that may form one vector, quaternion or set of motors.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/column_names.h"
#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

inline constexpr char kMixedUnits[] = "?";

/// Columns of one topic in the order of their indices.
struct ColumnGroup {
  std::size_t topic = 0;
  std::vector<int> columns;  ///< index into RawTopic::columns; -1: the log has no such part
  NameBits bits{};           ///< the least of its columns
  std::string unit;          ///< that all of its names state, or kMixedUnits
  IndexKind kind =
      IndexKind::kNone;  ///< kNone: neighbours in the file whose names do not say that they belong together
  bool is_foreign = false, is_wish = false, says_down = false, says_up = false;  ///< as NameReading
  bool is_east_north_up = false;  ///< of compass columns: x east, y north, z up, and not north, east, down
};

/// Returns the groups of three, four, six or eight columns that names tell (x y z, roll pitch yaw, n e d, 0 .. 3,
/// parts of them where only some axes are logged), single columns called like a battery, and, of columns that no
/// name groups, each three and four neighbours. Columns of `taken` (by topic and column) are left out.
std::vector<ColumnGroup> column_groups(const RawLog& log, const std::vector<std::vector<char>>& taken);

/// Returns whether signals of this topic are found by evidence: messages of known types have their own names.
bool is_plain_table(const RawLog& log, const RawTopic& topic);

}  // namespace swarmcert::logs

/// @file Result of one check of a release with its limit.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace swarmcert::gate {

enum class Verdict { kPass, kFail, kInconclusive };
/// "pass", "fail" or "inconclusive".
const char* name(Verdict verdict);

/// A number of the policy.
struct Limit {
  double value = 0;
  int line = 0;         ///< of the policy
  std::string unit;     ///< of `value`; empty: none, or the network's own
  double unit_N = 0;    ///< newton per unit of force, where `unit` begins with one; else 0
  bool is_most = true;  ///< the value may be at most this; else at least
};

/// One row of the result. Only judge() and pass() make a row pass.
struct Check {
  std::string name;  ///< the policy's table; further limits of the same table: "table.limit"
  std::optional<double> value, limit, baseline;
  std::string unit;
  bool more_is_worse = true;  ///< for regressions
  Verdict verdict = Verdict::kInconclusive;
  int line = 0;         ///< of the limit in the policy, or of the table
  std::string witness;  ///< what shows the failure, or where the value comes from
  std::string reason;   ///< why it did not pass
  bool is_bad_input = false;
  bool stands_for_table = false;  ///< the table could not be judged: its other rows are lacking
};

using Checks = std::vector<Check>;

/// The limits of the policy's table [regression], in percent.
struct RegressionLimits {
  std::optional<double> most;         ///< nothing: the policy has no such table
  std::map<std::string, double> own;  ///< by name of the row that has one of its own
};

/// A row that judges nothing yet.
Check row(const std::string& name, int line);
Check row(const std::string& name, const Limit& limit);

/// Pass if `proved` keeps the row's limit; fail if `attained`, which the quantity reaches or passes for certain, breaks
/// it; else inconclusive, as for NaN. Quantities that are known pass the same number twice.
void judge(Check& row, const Limit& limit, double proved, double attained);

/// Nothing is known to be attained.
inline double nothing_attained(const Limit& limit) {
  return limit.is_most ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
}

/// For claims without a number.
void pass(Check& row);
void fail(Check& row, const std::string& reason);

}  // namespace swarmcert::gate

/// @file The result of one check of a release with its limit.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace swarmcert::gate {

enum class Verdict { kPass, kFail, kInconclusive };
/// Returns "pass", "fail" or "inconclusive".
const char* name(Verdict verdict);

/// A limit stated in the policy.
struct Limit {
  double value = 0;
  int line = 0;         ///< line in the policy
  std::string unit;     ///< unit of `value`; empty: none, or the network's own
  double unit_N = 0;    ///< newtons per unit of force if `unit` starts with a force unit; else 0
  bool is_most = true;  ///< the value may be at most this; otherwise at least
};

/// One row of the result. Only judge() and pass() can set a row to kPass.
struct Check {
  std::string name;  ///< name of the policy's table; further limits of the same table: "table.limit"
  std::optional<double> value, limit, baseline;
  std::string unit;
  bool more_is_worse = true;  ///< direction used for regressions
  Verdict verdict = Verdict::kInconclusive;
  int line = 0;         ///< line of the limit in the policy, or of the table
  std::string witness;  ///< evidence of the failure, or source of the value
  std::string reason;   ///< why the check did not pass
  bool is_bad_input = false;
  bool stands_for_table = false;  ///< the table could not be judged, so its other rows are missing
};

using Checks = std::vector<Check>;

/// Returns a row without a verdict.
Check row(const std::string& name, int line);
Check row(const std::string& name, const Limit& limit);

/// Sets the verdict: pass if `proved` keeps the row's limit; fail if `attained`, a value that the quantity certainly
/// reaches or exceeds, breaks the limit; otherwise, and for NaN, inconclusive. For exactly known quantities pass the
/// same number twice.
void judge(Check& row, const Limit& limit, double proved, double attained);

/// Value of `attained` for judge() if no value is known to be attained.
inline double nothing_attained(const Limit& limit) {
  return limit.is_most ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
}

/// Sets the verdict of claims without a number.
void pass(Check& row);
void fail(Check& row, const std::string& reason);

}  // namespace swarmcert::gate

#include "analysis/gate/check.h"

#include <fmt/core.h>

namespace swarmcert::gate {

const char* name(Verdict verdict) {
  return verdict == Verdict::kPass ? "pass" : verdict == Verdict::kFail ? "fail" : "inconclusive";
}

Check row(const std::string& name, int line) {
  Check check;
  check.name = name;
  check.line = line;
  return check;
}

Check row(const std::string& name, const Limit& limit) {
  Check check = row(name, limit.line);
  check.limit = limit.value;
  check.unit = limit.unit;
  check.more_is_worse = limit.is_most;
  return check;
}

void judge(Check& row, const Limit& limit, double proved, double attained) {
  row.value = proved;
  const bool keeps = limit.is_most ? proved <= limit.value : proved >= limit.value;
  const bool breaks = limit.is_most ? attained > limit.value : attained < limit.value;
  if (keeps) {
    row.verdict = Verdict::kPass;
  } else if (breaks) {
    row.verdict = Verdict::kFail;
    row.reason = fmt::format("{:.6g} is {} {:.6g}", proved, limit.is_most ? "above" : "below", limit.value);
  } else {
    row.verdict = Verdict::kInconclusive;
    row.reason = fmt::format("{:.6g} does not prove {} {:.6g}, and nothing refutes it", proved,
                             limit.is_most ? "at most" : "at least", limit.value);
  }
}

void pass(Check& row) { row.verdict = Verdict::kPass; }

void fail(Check& row, const std::string& reason) {
  row.verdict = Verdict::kFail;
  row.reason = reason;
}

}  // namespace swarmcert::gate

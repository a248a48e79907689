#include "analysis/gate/check.h"

#include <fmt/core.h>

#include <utility>

namespace swarmcert::gate {
namespace {

/// The two numbers with six digits, or with as many as tell them apart.
std::pair<std::string, std::string> told_apart(double a, double b) {
  std::pair<std::string, std::string> texts;
  for (int digits = 6; digits <= 17; ++digits) {
    texts = {fmt::format("{:.{}g}", a, digits), fmt::format("{:.{}g}", b, digits)};
    if (texts.first != texts.second) break;
  }
  return texts;
}

}  // namespace

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
    const auto [value, bound] = told_apart(proved, limit.value);
    row.reason = fmt::format("{} is {} {}", value, limit.is_most ? "above" : "below", bound);
  } else {
    row.verdict = Verdict::kInconclusive;
    const auto [value, bound] = told_apart(proved, limit.value);
    row.reason = fmt::format("{} does not prove {} {}, and nothing refutes it", value,
                             limit.is_most ? "at most" : "at least", bound);
  }
}

void pass(Check& row) { row.verdict = Verdict::kPass; }

void fail(Check& row, const std::string& reason) {
  row.verdict = Verdict::kFail;
  row.reason = reason;
}

}  // namespace swarmcert::gate

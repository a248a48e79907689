#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/gate/baseline.h"
#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"
#include "nn/base/toml.h"

namespace swarmcert::gate {
namespace {

/// Returns by how many percent of the baseline's value a value is worse; 0 if it is not worse.
double worse_percent(const Check& check, double baseline) {
  const double change = (check.more_is_worse ? 1 : -1) * (*check.value - baseline);
  if (change <= 0) return 0;
  return baseline == 0 ? std::numeric_limits<double>::infinity() : 100 * change / std::abs(baseline);
}

/// Requires that every row with a percentage of its own exists, unless its table could not be judged.
void require_rows(const std::map<std::string, Limit>& own, const Checks& checks, const std::string& policy) {
  std::vector<std::string> rows;
  for (const Check& check : checks) rows.push_back(check.name);
  for (const auto& [name, limit] : own) {
    const auto stands_for = [&name = name](const Check& check) {
      return check.name == name || (check.stands_for_table && name.rfind(check.name + ".", 0) == 0);
    };
    if (std::any_of(checks.begin(), checks.end(), stands_for)) continue;
    throw files::InputError({policy, "line " + std::to_string(limit.line), "regression.percent_of." + name,
                             "", "is not a row of this policy's checks", files::did_you_mean(name, rows)});
  }
}

}  // namespace

void describe_regression_keys(files::Keys& keys) {
  keys.must<double>("max_increase_percent", "By how much a value may rise above the last release.", "%");
  keys.may<std::map<std::string, double>>("percent_of", "The same by check.", "%");
}

Run read_regression(const files::TomlTable& table, Policy&) {
  const std::optional<Limit> most = limit(table, "max_increase_percent", "%");
  if (!most) refuse_without_limit(table, "max_increase_percent = 5");
  if (most->value < 0)
    table.refuse("max_increase_percent", fmt::format("{}", most->value), "must not be negative");
  std::map<std::string, Limit> own;
  if (table.has("percent_of")) {
    const files::TomlTable inner = table.table("percent_of");
    for (const std::string& name : inner.keys()) own[name] = *limit(inner, name, "%");
  }
  return [most = *most, own](Evidence& evidence, Checks& checks) {
    const Baseline* const baseline = evidence.baseline();
    if (baseline == nullptr) {
      if (evidence.settings().may_lack_baseline) return;  // this release becomes the first baseline
      throw files::InputError({evidence.policy().path, "", "regression", "",
                               "has no baseline to compare with",
                               "give --baseline FILE; --update-baseline writes the first one"});
    }
    require_rows(own, checks, evidence.policy().path);
    Check check = row("regression", most);
    double worst = 0, excess = -std::numeric_limits<double>::infinity();
    int compared = 0;
    std::string missing;
    for (const Check& now : checks) {
      if (!now.limit || now.is_bad_input) continue;
      const auto before = baseline->values.find(now.name);
      if (before == baseline->values.end()) continue;
      ++compared;
      if (!now.value || std::isnan(*now.value)) {
        missing += (missing.empty() ? "" : ", ") + now.name;
        continue;
      }
      const double percent = worse_percent(now, before->second);
      const auto found = own.find(now.name);
      const Limit& limit = found == own.end() ? most : found->second;
      if (!(percent - limit.value > excess)) continue;
      excess = percent - limit.value;
      worst = percent;
      check.line = limit.line;
      check.limit = limit.value;
      check.witness = fmt::format("{}: {:.6g} before, {:.6g} now", now.name, before->second, *now.value);
    }
    if (compared == 0) {
      fail(check, "the baseline contains no values for this policy");
    } else if (!missing.empty()) {
      check.value = worst;
      check.reason = "has a baseline, but no value now: " + missing;
    } else {
      Limit limit = most;
      limit.value = *check.limit;
      judge(check, limit, worst, worst);
    }
    checks.push_back(std::move(check));
  };
}

}  // namespace swarmcert::gate

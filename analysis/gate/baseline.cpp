#include "analysis/gate/baseline.h"

#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::gate {
namespace {

constexpr char kBaselineSchema[] = "swarmcert/baseline/2";
constexpr char kMend[] = "write it again with swarmcert gate --update-baseline";

bool is_of_regression(const std::string& name) { return name.rfind("regression", 0) == 0; }

std::string table_of(const std::string& name) { return name.substr(0, name.find('.')); }

files::Json json_of(const Checks& checks) {
  files::Json json = files::Json::object();
  for (const Check& check : checks) {
    if (is_of_regression(check.name)) continue;
    files::Json limit;
    if (check.limit && std::isfinite(*check.limit))
      limit = {{check.more_is_worse ? "most" : "least", *check.limit}};
    json[check.name] = std::move(limit);
  }
  return json;
}

files::Json json_of(const RegressionLimits& regression) {
  if (!regression.most) return {};
  files::Json json = {{"most_percent", *regression.most}, {"percent_of", files::Json::object()}};
  for (const auto& [name, percent] : regression.own) json["percent_of"][name] = percent;
  return json;
}

std::optional<BaselineLimit> limit_in(const files::Json& json) {
  if (json.is_null()) return std::nullopt;
  const bool is_most = json.contains("most");
  files::require_keys(json, {is_most ? "most" : "least"}, "a limit");
  return BaselineLimit{json[is_most ? "most" : "least"].get<double>(), is_most};
}

RegressionLimits regression_in(const files::Json& json) {
  RegressionLimits regression;
  if (json.is_null()) return regression;
  files::require_keys(json, {"most_percent", "percent_of"}, "regression");
  regression.most = json["most_percent"].get<double>();
  for (const auto& [name, percent] : json["percent_of"].items()) regression.own[name] = percent.get<double>();
  return regression;
}

/// The percentage that [regression] allows a row; infinite if there is no such table.
double allowed_percent(const RegressionLimits& regression, const std::string& name) {
  if (!regression.most) return std::numeric_limits<double>::infinity();
  const auto own = regression.own.find(name);
  return own == regression.own.end() ? *regression.most : own->second;
}

std::string loosened_row(const std::string& name, const std::optional<BaselineLimit>& before,
                         const Check& now) {
  if (!before) return "";
  if (!now.limit) return fmt::format("{}: its limit {:.6g} was dropped", name, before->value);
  if (before->is_most != now.more_is_worse)
    return fmt::format("{}: its limit {:.6g} bounds the other side now", name, before->value);
  const bool is_looser = before->is_most ? *now.limit > before->value : *now.limit < before->value;
  if (!is_looser) return "";
  return fmt::format("{}: {} {:.6g} before, {:.6g} now", name, before->is_most ? "at most" : "at least",
                     before->value, *now.limit);
}

}  // namespace

std::vector<std::string> loosened(const Baseline& baseline, const Checks& checks,
                                  const RegressionLimits& regression) {
  std::map<std::string, const Check*> now;
  std::set<std::string> not_judged;
  for (const Check& check : checks) {
    now[check.name] = &check;
    if (check.stands_for_table) not_judged.insert(table_of(check.name));
  }
  std::vector<std::string> all;
  std::set<std::string> names;
  for (const auto& [name, limit] : baseline.checks) {
    names.insert(name);
    const auto found = now.find(name);
    if (not_judged.count(table_of(name)) == 1) continue;  // fails on its own
    std::string what =
        found == now.end() ? name + ": the check was dropped" : loosened_row(name, limit, *found->second);
    if (!what.empty()) all.push_back(std::move(what));
  }
  if (baseline.regression.most && !regression.most) {
    all.emplace_back("regression: the check was dropped");
    return all;
  }
  if (baseline.regression.most && *regression.most > *baseline.regression.most)
    all.push_back(fmt::format("regression: at most {:.6g} % before, {:.6g} % now", *baseline.regression.most,
                              *regression.most));
  for (const std::string& name : names) {
    const bool has_own = baseline.regression.own.count(name) + regression.own.count(name) > 0;
    const double before = allowed_percent(baseline.regression, name),
                 after = allowed_percent(regression, name);
    if (has_own && after > before)
      all.push_back(
          fmt::format("regression.percent_of.{}: {:.6g} % before, {:.6g} % now", name, before, after));
  }
  return all;
}

std::unique_ptr<Baseline> read_baseline(const std::string& path, bool may_lack) {
  if (may_lack && !std::filesystem::exists(path)) return nullptr;
  const files::Json document = files::read_json(path, kBaselineSchema);
  try {
    files::require_keys(document, {"schema", "tool", "values", "checks", "regression", "content_sha256"},
                        "the baseline");
    if (document["content_sha256"] != files::content_sha256(document))
      throw std::invalid_argument("content_sha256 is not that of the content");
    auto baseline = std::make_unique<Baseline>();
    for (const auto& [name, value] : document["values"].items()) baseline->values[name] = value.get<double>();
    for (const auto& [name, limit] : document["checks"].items()) baseline->checks[name] = limit_in(limit);
    baseline->regression = regression_in(document["regression"]);
    return baseline;
  } catch (const std::exception& error) {
    throw files::InputError({path, "", "", "", error.what(), kMend});
  }
}

void write_baseline(const std::string& path, const Checks& checks, const RegressionLimits& regression) {
  files::Json values = files::Json::object();
  for (const Check& check : checks) {
    if (!is_of_regression(check.name) && check.value && std::isfinite(*check.value))
      values[check.name] = *check.value;
  }
  files::Json document = {{"schema", kBaselineSchema},
                          {"tool", "swarmcert " SWARMCERT_VERSION},
                          {"values", std::move(values)},
                          {"checks", json_of(checks)},
                          {"regression", json_of(regression)}};
  document["content_sha256"] = files::content_sha256(document);
  files::write_file(path, files::to_text(document), true);
}

}  // namespace swarmcert::gate

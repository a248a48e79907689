#include "analysis/gate/outputs.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "analysis/gate/text.h"

namespace swarmcert::gate {
namespace {

files::Json number_json(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? files::Json(*value) : files::Json();
}

std::string summary(const GateResult& result) {
  std::string text = fmt::format("{} checks: {} passed, {} failed, {} inconclusive", result.checks.size(),
                                 result.count(Verdict::kPass), result.count(Verdict::kFail),
                                 result.count(Verdict::kInconclusive));
  if (!result.not_run.empty()) text += fmt::format("; {} not asked for", result.not_run.size());
  return text;
}

/// Formats the limit with its direction: "<= 500".
std::string limit_words(const Check& check) {
  return check.limit ? (check.more_is_worse ? "<= " : ">= ") + number(check.limit) : "-";
}

/// Returns one line for annotations: the value, its limit, why the check did not pass, and the evidence.
std::string message(const Check& check) {
  std::string text = fmt::format("{}: {}", check.name, name(check.verdict));
  if (check.value) text += fmt::format(", value {}", number(check.value));
  if (check.limit) text += fmt::format(", limit {}", limit_words(check));
  if (!check.unit.empty()) text += " " + check.unit;
  if (check.baseline) text += fmt::format(", baseline {}", number(check.baseline));
  if (!check.reason.empty()) text += ". " + check.reason;
  if (!check.witness.empty()) text += ". Witness: " + check.witness;
  return text;
}

bool is_warning(const Check& check, bool allow_inconclusive) {
  return allow_inconclusive && check.verdict == Verdict::kInconclusive;
}

}  // namespace

std::string to_table(const GateResult& result) {
  std::size_t width = 5, unit_width = 4;
  for (const Check& check : result.checks) {
    width = std::max(width, check.name.size());
    unit_width = std::max(unit_width, check.unit.size());
  }
  std::string text = fmt::format("Release of {}\n  {:<{}}  {:<12}  {:>12}  {:>15}  {:>12}  {:<{}}  line\n",
                                 printable(result.policy), "check", width, "verdict", "value", "limit",
                                 "baseline", "unit", unit_width);
  for (const Check& check : result.checks) {
    text += fmt::format("  {:<{}}  {:<12}  {:>12}  {:>15}  {:>12}  {:<{}}  {}\n", printable(check.name),
                        width, name(check.verdict), number(check.value), limit_words(check),
                        number(check.baseline), printable(check.unit), unit_width, check.line);
  }
  for (const Check& check : result.checks) {
    if (check.verdict == Verdict::kPass) continue;
    text += fmt::format("\n{} {} (line {}): {}\n", name(check.verdict), printable(check.name), check.line,
                        printable(check.reason));
    if (!check.witness.empty()) text += fmt::format("  {}\n", printable(check.witness));
  }
  if (!result.not_run.empty()) text += fmt::format("\nnot asked for: {}\n", fmt::join(result.not_run, ", "));
  return text + fmt::format("\n{}\nverdict: {}\n", summary(result), name(result.verdict()));
}

void describe(files::Record& record, const GateResult& result) {
  record.field("policy", printable(result.policy), "The policy file.");
  record.field("verdict", std::string(name(result.verdict())),
               "pass, fail or inconclusive: fail if one check fails, pass if all pass.");
  record.list("checks", result.checks, "One entry per check.", [](files::Record& r, const Check& check) {
    const auto sense =
        check.limit ? std::optional<std::string>(check.more_is_worse ? "at_most" : "at_least") : std::nullopt;
    r.field("name", printable(check.name), "Table of the policy; further limits of it: table.limit.");
    r.field("value", check.value, "What was proved or measured.");
    r.field("limit", check.limit, "What the policy allows.");
    r.field("sense", sense, "at_most or at_least; null: there is no limit.");
    r.field("baseline", check.baseline, "The value of the last release.");
    r.field("unit", printable(check.unit), "Of these three.");
    r.field("verdict", std::string(name(check.verdict)), "pass, fail or inconclusive.");
    r.field("line", check.line, "Of the policy.");
    r.field("witness", printable(check.witness), "Evidence of a failure, or source of the value.");
    r.field("reason", printable(check.reason), "Why the check did not pass.");
    r.field("bad_input", check.is_bad_input, "Whether a file is missing or damaged.");
  });
  record.list("changes", result.changes, "Conditions that differ from those of the baseline.",
              [](files::Record& r, const Change& change) {
                r.field("condition", printable(change.key), "Dotted key, such as tracking.amplitude_N.");
                r.field("before", change.before, "Null: not there.");
                r.field("now", change.now, "Null: not there.");
                r.field(
                    "claim", std::string(name(change.claim)),
                    "What the release claims now: stronger, the same, weaker, or open, where nothing shows "
                    "that it claims as much. Weaker and open fail.");
              });
  record.field("not_run", result.not_run, "Checks that the policy does not ask for.");
}

std::string to_junit(const GateResult& result) {
  const auto is_error = [](const Check& check) {
    return check.is_bad_input || check.verdict == Verdict::kInconclusive;
  };
  const auto errors = std::count_if(result.checks.begin(), result.checks.end(), is_error);
  const auto failures = std::count_if(result.checks.begin(), result.checks.end(), [&](const Check& check) {
    return check.verdict == Verdict::kFail && !is_error(check);
  });
  const std::string counts =
      fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"0\"",
                  result.checks.size() + result.not_run.size(), failures, errors, result.not_run.size());
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  text += fmt::format("<testsuites name=\"swarmcert gate\" {}>\n", counts);
  text += fmt::format("  <testsuite name=\"{}\" {}>\n", xml(result.policy), counts);
  for (const Check& check : result.checks) {
    text += fmt::format(
        "    <testcase classname=\"swarmcert.gate\" name=\"{}\" file=\"{}\" line=\"{}\" time=\"0\"",
        xml(check.name), xml(result.policy_in_repository), check.line);
    if (check.verdict == Verdict::kPass) {
      text += "/>\n";
      continue;
    }
    const char* const element = is_error(check) ? "error" : "failure";
    const char* const type = check.is_bad_input ? "bad input" : name(check.verdict);
    text += fmt::format(">\n      <{} type=\"{}\" message=\"{}\">{}</{}>\n    </testcase>\n", element, type,
                        xml(check.reason), xml(message(check)), element);
  }
  for (const std::string& kind : result.not_run) {
    text += fmt::format(
        "    <testcase classname=\"swarmcert.gate\" name=\"{}\" file=\"{}\" time=\"0\">\n"
        "      <skipped message=\"the policy does not ask for it\"/>\n    </testcase>\n",
        xml(kind), xml(result.policy_in_repository));
  }
  return text + "  </testsuite>\n</testsuites>\n";
}

std::string to_sarif(const GateResult& result, bool allow_inconclusive) {
  using files::Json;
  Json rules = Json::array();
  const auto rule = [&rules](const std::string& id, const std::string& summary) {
    rules.push_back({{"id", id},
                     {"name", id},
                     {"shortDescription", {{"text", summary}}},
                     {"defaultConfiguration", {{"level", "error"}}}});
  };
  for (const CheckKind& kind : check_kinds()) rule(kind.name, kind.summary);
  rule("release", "every file of the release can be read");
  rule("policy", "the policy can be read");
  Json results = Json::array();
  for (const Check& check : result.checks) {
    if (check.verdict == Verdict::kPass) continue;
    const std::string id = check.name.substr(0, check.name.find('.'));
    const auto same = [&id](const Json& one) { return one["id"] == id; };
    const auto index = std::find_if(rules.begin(), rules.end(), same) - rules.begin();
    const Json location = {{"physicalLocation",
                            {{"artifactLocation", {{"uri", uri(result.policy_in_repository)}, {"index", 0}}},
                             {"region", {{"startLine", std::max(1, check.line)}}}}}};
    results.push_back({{"ruleId", id},
                       {"ruleIndex", index},
                       {"level", is_warning(check, allow_inconclusive) ? "warning" : "error"},
                       {"message", {{"text", printable(message(check))}}},
                       {"locations", Json::array({location})},
                       {"partialFingerprints", {{"check/v1", printable(check.name)}}},
                       {"properties",
                        {{"verdict", name(check.verdict)},
                         {"value", number_json(check.value)},
                         {"limit", number_json(check.limit)},
                         {"baseline", number_json(check.baseline)},
                         {"unit", printable(check.unit)},
                         {"bad_input", check.is_bad_input}}}});
  }
  const Json driver = {{"name", "swarmcert"},
                       {"version", SWARMCERT_VERSION},
                       {"semanticVersion", SWARMCERT_VERSION},
                       {"rules", std::move(rules)}};
  const Json run = {
      {"tool", {{"driver", driver}}},
      {"invocations", Json::array({Json{{"executionSuccessful", true}}})},
      {"artifacts", Json::array({Json{{"location", {{"uri", uri(result.policy_in_repository)}}}}})},
      {"columnKind", "utf16CodeUnits"},
      {"results", std::move(results)}};
  return files::to_text({{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
                         {"version", "2.1.0"},
                         {"runs", Json::array({run})}});
}

std::string to_github(const GateResult& result, bool allow_inconclusive) {
  std::string text;
  for (const Check& check : result.checks) {
    if (check.verdict == Verdict::kPass) continue;
    text += fmt::format("::{} file={},line={},title={}::{}\n",
                        is_warning(check, allow_inconclusive) ? "warning" : "error",
                        github(result.policy_in_repository, true), std::max(1, check.line),
                        github("swarmcert gate: " + check.name, true), github(message(check), false));
  }
  return text;
}

std::string to_markdown(const GateResult& result) {
  std::string text = fmt::format("## swarmcert gate: {}\n\n{}, policy {}\n\n", name(result.verdict()),
                                 summary(result), markdown(result.policy));
  text += "| verdict | check | value | limit | baseline | unit | policy line |\n";
  text += "|---|---|---:|---:|---:|---|---:|\n";
  for (const Check& check : result.checks) {
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", name(check.verdict), markdown(check.name),
                        number(check.value), markdown(limit_words(check)), number(check.baseline),
                        markdown(check.unit), check.line);
  }
  std::string failures;
  for (const Check& check : result.checks) {
    if (check.verdict == Verdict::kPass) continue;
    failures +=
        fmt::format("- **{}** (line {}): {}{}\n", markdown(check.name), check.line, markdown(check.reason),
                    check.witness.empty() ? "" : ". " + markdown(check.witness));
  }
  if (!failures.empty()) text += "\n" + failures;
  if (!result.not_run.empty())
    text += "\nNot asked for: " + markdown(fmt::format("{}", fmt::join(result.not_run, ", "))) + "\n";
  return text;
}

}  // namespace swarmcert::gate

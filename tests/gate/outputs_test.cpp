// Formats for continuous integration: required fields of each format, and names that try to break out of it.
#include "analysis/gate/outputs.h"

#include <gtest/gtest.h>

#include <limits>

#include "analysis/gate/text.h"

namespace swarmcert::gate {
namespace {

/// Control characters, markup of every format, invalid UTF-8, a workflow command.
const std::string kHostile =
    "a<b>&\"'|`]]>\x01\x1b[31m\xff\xc3\n::error::owned\r\n%0A*_{}\\<script>alert(1)</script>, line: 7 "
    "\xe2\x98\x83";

GateResult hostile_result() {
  GateResult result;
  result.policy = result.policy_in_repository = "dir " + kHostile + "/policy.toml";
  Check good = row("certificate", 3);
  pass(good);
  Check bad = row("lipschitz", {500, 7, "gf/(m, m/s)", 1, true});
  judge(bad, {500, 7, "gf/(m, m/s)", 1, true}, 510, 505);
  bad.witness = kHostile;
  bad.reason = kHostile;
  bad.baseline = 400;
  Check open = row("range", {80, 9, "gf", 1, true});
  judge(open, {80, 9, "gf", 1, true}, std::numeric_limits<double>::quiet_NaN(), 1);
  Check broken = row("residual", 11);
  fail(broken, kHostile);
  broken.is_bad_input = true;
  result.checks = {good, bad, open, broken};
  result.not_run = {"tracking"};
  return result;
}

bool has_controls(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\n'; });
}

/// A reader for the XML written by to_junit(): elements nest, attributes are quoted, no other markup.
testing::AssertionResult is_well_formed(const std::string& text) {
  std::vector<std::string> open;
  std::size_t at = text.find('\n') + 1;  // after the declaration
  while (at < text.size()) {
    const char c = text[at];
    if (c == '>' || c == '"') return testing::AssertionFailure() << "stray " << c << " at " << at;
    if (c == '&' && text.compare(at, 4, "&lt;") != 0 && text.compare(at, 4, "&gt;") != 0 &&
        text.compare(at, 5, "&amp;") != 0 && text.compare(at, 6, "&quot;") != 0 &&
        text.compare(at, 6, "&apos;") != 0)
      return testing::AssertionFailure() << "bare & at " << at;
    if (c != '<') {
      ++at;
      continue;
    }
    std::size_t end = at;
    for (bool quoted = false; end < text.size() && (quoted || text[end] != '>'); ++end) {
      if (text[end] == '"') quoted = !quoted;
      if (end > at && text[end] == '<') return testing::AssertionFailure() << "< inside a tag at " << end;
    }
    const std::string tag = text.substr(at + 1, end - at - 1);
    const std::string name =
        tag.substr(tag[0] == '/' ? 1 : 0, tag.find_first_of(" /", 1) - (tag[0] == '/' ? 1 : 0));
    if (tag[0] == '/') {
      if (open.empty() || open.back() != name)
        return testing::AssertionFailure() << "</" << name << "> closes nothing";
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
    at = end + 1;
  }
  return open.empty() ? testing::AssertionSuccess()
                      : testing::AssertionFailure() << open.back() << " is not closed";
}

int count(const std::string& text, const std::string& what) {
  int found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

TEST(GateOutputs, JUnitHasACasePerCheckAndSurvivesHostileNames) {
  const std::string text = to_junit(hostile_result());
  EXPECT_TRUE(is_well_formed(text)) << text;
  EXPECT_FALSE(has_controls(text));
  EXPECT_EQ(count(text, "<testcase "), 5);
  EXPECT_EQ(count(text, "<failure "), 1);
  EXPECT_EQ(count(text, "<error "), 2);  // inconclusive, and bad input
  EXPECT_EQ(count(text, "<skipped "), 1);
  EXPECT_EQ(count(text, "tests=\"5\" failures=\"1\" errors=\"2\" skipped=\"1\""), 2);
  EXPECT_EQ(count(text, " classname=\"swarmcert.gate\" name=\""), 5);
}

TEST(GateOutputs, SarifHasWhatTheStandardRequires) {
  const files::Json document = files::parse_json(to_sarif(hostile_result(), false), "gate.sarif");
  EXPECT_EQ(document["version"], "2.1.0");
  ASSERT_EQ(document["runs"].size(), 1u);
  const files::Json& run = document["runs"][0];
  const files::Json& driver = run["tool"]["driver"];
  EXPECT_EQ(driver["name"], "swarmcert");
  ASSERT_EQ(run["results"].size(), 3u);  // checks that pass give no result
  for (const files::Json& result : run["results"]) {
    EXPECT_FALSE(result["message"]["text"].get<std::string>().empty());
    const files::Json& rule = driver["rules"][result["ruleIndex"].get<std::size_t>()];
    EXPECT_EQ(rule["id"], result["ruleId"]);
    EXPECT_FALSE(rule["shortDescription"]["text"].get<std::string>().empty());
    EXPECT_EQ(result["level"], "error");
    const files::Json& place = result["locations"][0]["physicalLocation"];
    EXPECT_GE(place["region"]["startLine"].get<int>(), 1);
    const auto uri = place["artifactLocation"]["uri"].get<std::string>();
    EXPECT_EQ(uri.find_first_of(" <>\"\\^`{|}"), std::string::npos) << uri;
  }
  EXPECT_EQ(run["results"][0]["locations"][0]["physicalLocation"]["region"]["startLine"], 7);
  const files::Json lenient = files::parse_json(to_sarif(hostile_result(), true), "gate.sarif");
  EXPECT_EQ(lenient["runs"][0]["results"][1]["level"], "warning");
}

TEST(GateOutputs, GitHubGetsOneCommandPerLineWhateverTheNamesHold) {
  const std::string text = to_github(hostile_result(), false);
  std::istringstream lines(text);
  int annotations = 0;
  for (std::string line; std::getline(lines, line); ++annotations) {
    EXPECT_EQ(line.rfind("::error file=dir a", 0), 0u) << line;
    EXPECT_EQ(count(line, "\r"), 0);
    const std::string properties = line.substr(8, line.find("::", 8) - 8);
    EXPECT_EQ(count(properties, ","), 2) << properties;
    EXPECT_EQ(count(properties, ":"), 0) << properties;
  }
  EXPECT_EQ(annotations, 3);
  EXPECT_NE(text.find("%250A"), std::string::npos) << "a percent sign of a name is no escape";
}

TEST(GateOutputs, MarkdownTerminalAndJsonKeepTheirFrameWhateverTheNamesHold) {
  const GateResult result = hostile_result();
  const std::string page = to_markdown(result);
  EXPECT_EQ(page.find("<script"), std::string::npos) << page;
  EXPECT_FALSE(has_controls(page));
  std::istringstream lines(page);
  int rows = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| ", 0) != 0) continue;
    int bars = 0;
    for (std::size_t k = 0; k < line.size(); ++k)
      bars += line[k] == '|' && (k == 0 || line[k - 1] != '\\') ? 1 : 0;
    EXPECT_EQ(bars, 8) << line;
    ++rows;
  }
  EXPECT_EQ(rows, 5);  // the header and four checks
  EXPECT_FALSE(has_controls(to_table(result)));
  const files::Json json = files::to_json(files::record_of(result));
  const std::string text = files::to_text(json);  // throws for invalid UTF-8
  EXPECT_EQ(json["checks"][2]["value"], nullptr);
  EXPECT_EQ(json["checks"][2]["verdict"], "inconclusive");
  EXPECT_EQ(json["verdict"], "fail");
  EXPECT_NE(text.find("\xe2\x98\x83"), std::string::npos) << "letters beyond ASCII stay";
}

TEST(GateVerdict, NaNNeverPassesAndOnlyWhatIsAttainedFails) {
  const Limit most{1, 1, "", 0, true}, least{1, 1, "", 0, false};
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto verdict = [](const Limit& limit, double proved, double attained) {
    Check check = row("x", limit);
    judge(check, limit, proved, attained);
    return check.verdict;
  };
  EXPECT_EQ(verdict(most, 1, 1), Verdict::kPass);
  EXPECT_EQ(verdict(most, 1.1, 1), Verdict::kInconclusive);
  EXPECT_EQ(verdict(most, 1.1, 1.05), Verdict::kFail);
  EXPECT_EQ(verdict(least, 1, 1), Verdict::kPass);
  EXPECT_EQ(verdict(least, 0.9, 0.9), Verdict::kFail);
  for (const Limit& limit : {most, least}) {
    EXPECT_EQ(verdict(limit, nan, nan), Verdict::kInconclusive);
    EXPECT_NE(verdict(limit, limit.is_most ? inf : -inf, nan), Verdict::kPass);
  }
  GateResult none;
  EXPECT_NE(none.verdict(), Verdict::kPass) << "nothing was checked";
}

}  // namespace
}  // namespace swarmcert::gate

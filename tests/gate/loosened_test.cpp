// A policy that requires less than that of the baseline fails with the difference, unless its values become the next
// baseline.
#include "analysis/gate/baseline.h"
#include "gate/release.h"
#include "nn/base/input_error.h"

namespace swarmcert::tests {
namespace {

gate::Check limited(const std::string& name, double limit, bool is_most) {
  return gate::row(name, gate::Limit{limit, 1, "", 0, is_most});
}

std::string words(const gate::Baseline& baseline, const gate::Checks& checks,
                  const gate::RegressionLimits& regression = {}) {
  std::string all;
  for (const std::string& one : loosened(baseline, checks, regression)) all += one + "\n";
  return all;
}

TEST(GateBaseline, NamesEveryLoosenedLimitAndDroppedCheckAndNothingElse) {
  const TempFolder folder;
  const gate::Checks then = {limited("a", 5, true), limited("b", 5, false), gate::row("certificate", 1)};
  gate::write_baseline(folder / "b.json", then, {5.0, {{"a", 2.0}}});
  const gate::Baseline baseline = *gate::read_baseline(folder / "b.json", false);
  const gate::RegressionLimits same = {5.0, {{"a", 2.0}}};
  EXPECT_EQ(words(baseline, then, same), "");
  EXPECT_EQ(words(baseline, {limited("a", 4, true), limited("b", 6, false), then[2], limited("new", 1, true)},
                  same),
            "")
      << "stricter, and one check more";
  EXPECT_EQ(words(baseline, {limited("a", 6, true), limited("b", 4, false), then[2]}, same),
            "a: at most 5 before, 6 now\nb: at least 5 before, 4 now\n");
  EXPECT_EQ(words(baseline, {then[0], then[1]}, same), "certificate: the check was dropped\n");
  EXPECT_EQ(words(baseline, {gate::row("a", 1), then[1], then[2]}, same), "a: its limit 5 was dropped\n");
  EXPECT_EQ(words(baseline, {limited("a", 5, false), then[1], then[2]}, same),
            "a: its limit 5 bounds the other side now\n");
  EXPECT_EQ(words(baseline, then, {}), "regression: the check was dropped\n");
  EXPECT_EQ(words(baseline, then, {6.0, {{"a", 2.0}}}), "regression: at most 5 % before, 6 % now\n");
  EXPECT_EQ(words(baseline, then, {5.0, {}}), "regression.percent_of.a: 2 % before, 5 % now\n");
  EXPECT_EQ(words(baseline, then, {5.0, {{"a", 2.0}, {"b", 9.0}}}),
            "regression.percent_of.b: 5 % before, 9 % now\n");
  // A table that could not be judged fails on its own: its rows do not count as dropped.
  gate::Check unreadable = gate::row("b", 1);
  unreadable.stands_for_table = true;
  EXPECT_EQ(words(baseline, {then[0], unreadable, then[2]}, same), "");
}

TEST(GateBaseline, AnOlderOneWithoutLimitsIsRefused) {
  const TempFolder folder;
  write_text(folder / "old.json", "{\"schema\": \"swarmcert/baseline/1\", \"values\": {}}");
  EXPECT_THROW(gate::read_baseline(folder / "old.json", false), files::InputError);
}

TEST(GateCommand, ALoosenedLimitOrADroppedCheckFailsUnlessTheBaselineIsUpdated) {
  const ReleaseFolder release;
  const std::string command = "swarmcert gate policy.toml -q --baseline baseline.json";
  const auto policy = [&](const std::string& facts, const std::string& more) {
    release.policy_of(
        {"firmware_facts\n" + facts, "regression\nmax_increase_percent = 5" + more, "certificate"});
  };
  policy("max_flash_bytes = 30000\nmax_ram_bytes = 8192", "");
  ASSERT_EQ(release.run(command + " --update-baseline").exit_code, 0);
  ASSERT_EQ(release.run(command).exit_code, 0);

  const auto expect = [&](int exit_code, const std::string& word, const std::string& options = "") {
    const Outcome outcome = release.run(command + options);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.output;
    EXPECT_NE(outcome.output.find(word), std::string::npos) << word << " in\n" << outcome.output;
  };
  policy("max_flash_bytes = 25000\nmax_ram_bytes = 8192", "");
  expect(0, "verdict: pass");
  policy("max_flash_bytes = 40000", "");
  expect(1,
         "firmware_facts.flash: at most 30000 before, 40000 now; firmware_facts.ram: the check was dropped");
  policy("max_flash_bytes = 30000\nmax_ram_bytes = 8192", "0");
  expect(1, "regression: at most 5 % before, 50 % now");
  release.policy_of({"firmware_facts\nmax_flash_bytes = 30000\nmax_ram_bytes = 8192"});
  expect(1, "certificate: the check was dropped; regression: the check was dropped");

  policy("max_flash_bytes = 40000", "");
  expect(0, "verdict: pass", " --update-baseline --bundle bundle");
  expect(0, "verdict: pass");
  EXPECT_EQ(release.run("swarmcert verify-bundle bundle --rerun -q").exit_code, 0);
}

}  // namespace
}  // namespace swarmcert::tests

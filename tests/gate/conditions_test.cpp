// A release that is judged under weaker conditions than its baseline fails with every difference, unless its values and
// conditions become the next baseline.
#include "analysis/gate/conditions.h"

#include <fmt/core.h>

#include <filesystem>

#include "analysis/gate/baseline.h"
#include "gate/release.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

using gate::Conditions;

Conditions of(const std::string& tables) {
  return gate::conditions_of_policy("schema = \"swarmcert/policy/1\"\n" + tables, "policy.toml");
}

/// Every change as "claim: words".
std::string said(const Conditions& before, const Conditions& now) {
  std::string all;
  for (const gate::Change& change : gate::changes(before, now))
    all += std::string(gate::name(change.claim)) + ": " + words(change) + "\n";
  return all;
}

TEST(GateConditions, EveryWeakeningOfAPolicyIsNamedWithOldAndNewValueAndItsReverseIsStronger) {
  const std::string flown = "[release]\nflights = [\"f\"]\nlogs = 2\n";
  // The stronger policy, the weaker one, and what is said of the step from the first to the second.
  const std::vector<std::array<std::string, 3>> pairs = {
      {"[tracking]\namplitude_N = 0.2\n", "[tracking]\namplitude_N = 0.02\n",
       "amplitude_N: 0.2 before, 0.02 now"},
      {"[tracking]\namplitude_N = 0.2\nvelocity_error_m_s = 0.1\n", "[tracking]\namplitude_N = 0.2\n",
       "velocity_error_m_s: 0.1 before, 0 now"},
      {"[tracking]\nguard_factor = 1.5\n", "[tracking]\nguard_factor = 1\n",
       "guard_factor: 1.5 before, 1 now"},
      {"[tracking.uncertainty]\nmass_kg = [0.03, 0.04]\n",
       "[tracking.uncertainty]\nmass_kg = [0.034, 0.034]\n",
       "mass_kg: [0.03,0.04] before, [0.034,0.034] now"},
      {"[release]\nbattery_V = 4.0\n", "[release]\nbattery_V = 4.5\n", "battery_V: 4 before, 4.5 now"},
      {"[release]\nbattery_V = 4.0\n", "[release]\n", "battery_V: 4 before, 4.2 now"},
      {"[theorem]\nmax_ball_m = 1\nrate_N_s = 0.3\n", "[theorem]\nmax_ball_m = 1\nrate_N_s = 0.03\n",
       "rate_N_s: 0.3 before, 0.03 now"},
      {"[tracking]\nrate_N_s = 1\n", "[tracking]\nrate_N_s = 1\namplitude_N = 0.1\n",
       "amplitude_N: infinite before, 0.1 now"},
      {"[hashes]\n\"a.toml\" = \"1\"\n\"b.toml\" = \"2\"\n", "[hashes]\n\"a.toml\" = \"1\"\n",
       "hashes.b.toml: 2 before, none now"},
      {"[tracking]\nover = \"box\"\n", "[tracking]\nover = \"corners\"\n", "over: box before, corners now"},
      {"[tracking]\n", "[tracking]\nover = \"corners\"\n", "over: box before, corners now"},
      {flown + "[tracking]\nquantile = \"max\"\n", flown + "[tracking]\n", "quantile: max before, p99 now"},
      {"[lipschitz]\nmax_joint_gf = 5\n", "[lipschitz]\nmax_joint_gf = 5\ndomain = \"box\"\n",
       "domain: global before, box now"},
      {"[lipschitz]\nfunctions = { a = 1, b = 2 }\n", "[lipschitz]\nfunctions = { a = 1 }\n",
       "functions.b: 2 before, none now"},
      {"[range]\nmax_jump_gf = 4\nneighbours = 3\n", "[range]\nmax_jump_gf = 4\n",
       "neighbours: 3 before, 1 now"},
      {"[range]\nmin_force_gf = -4\n", "[range]\nmin_force_gf = -5\n", "min_force_gf: -4 before, -5 now"},
      {"[firmware_facts]\nmax_flash_bytes = 3\nmax_ram_bytes = 4\n",
       "[firmware_facts]\nmax_flash_bytes = 3\n", "max_ram_bytes: 4 before, none now"},
      {"[regression]\nmax_increase_percent = 5\n",
       "[regression]\nmax_increase_percent = 5\npercent_of = { b = 9 }\n", "b: none before, 9 now"},
      {"[regression]\nmax_increase_percent = 5\npercent_of = { b = 2 }\n",
       "[regression]\nmax_increase_percent = 5\n", "b: 2 before, none now"},
      {"[certificate]\n[match]\n", "[match]\n", "certificate: the check was dropped"},
      {"[match]\nentry = \"controller\"\n", "[match]\n", "entry: controller before, network now"},
  };
  for (const auto& [strong, weak, words] : pairs) {
    const std::string down = said(of(strong), of(weak)), up = said(of(weak), of(strong));
    EXPECT_EQ(down.rfind("weaker: ", 0), 0u) << down << strong << weak;
    EXPECT_NE(down.find(words), std::string::npos) << down << " lacks " << words;
    EXPECT_EQ(std::count(down.begin(), down.end(), '\n'), 1) << down;
    EXPECT_EQ(up.rfind("stronger: ", 0), 0u) << up << strong << weak;
    EXPECT_EQ(said(of(strong), of(strong)), "");
  }
}

TEST(GateConditions, AChangeThatNothingOrdersIsOpenAndAnotherReleasedFileIsNone) {
  const auto claim = [](const Conditions& before, const Conditions& now) {
    const std::vector<gate::Change> all = gate::changes(before, now);
    for (const gate::Change& change : all)
      if (change.asks_for_less()) return gate::name(change.claim);
    return all.empty() ? "none" : gate::name(all[0].claim);
  };
  EXPECT_STREQ(claim(of("[release]\nprecision = \"float32\"\n"), of("[release]\nprecision = \"float64\"\n")),
               "open");
  EXPECT_STREQ(claim(of("[tracking.uncertainty]\nmass_kg = [1, 2]\n"),
                     of("[tracking.uncertainty]\nmass_kg = [1.5, 3]\n")),
               "open");
  EXPECT_STREQ(claim(of("[lipschitz]\nmax_joint_gf = 5\n"), of("[lipschitz]\nmax_joint_N = 0.01\n")),
               "weaker")
      << "a limit in another unit is another limit";
  EXPECT_STREQ(claim(of("[x]\nnew_key = 1\n"), of("[x]\nnew_key = 2\n")), "open") << "a key without an order";
  EXPECT_STREQ(claim(of("[x]\n"), of("[x]\nnew_key = 2\n")), "open") << "its absence may be stronger";
  EXPECT_STREQ(claim({}, {{"inputs.columns", {{"columns.toml", "1"}}}}), "open")
      << "the logs are read otherwise";
  EXPECT_STREQ(claim({{"inputs.model", {{"m.toml", "1"}}}}, {{"inputs.model", {{"m.toml", "2"}}}}), "open");
  EXPECT_STREQ(claim({{"inputs.log", {{"a", "1"}}}}, {{"inputs.log", {{"a", "1"}, {"b", "2"}}}}), "open")
      << "calm flights would thin out the others";
  EXPECT_STREQ(claim({{"inputs.weights", {{"phi", "1"}}}}, {{"inputs.weights", {{"psi", "2"}}}}), "same");
  EXPECT_STREQ(claim({{"box.phi", {{-1, 1}, {-2, 2}}}}, {{"box.phi", {{-1, 1}, {-1, 2}}}}), "weaker");
  EXPECT_STREQ(claim(of("[release]\nnetwork = \"a\"\n"), of("[release]\nnetwork = \"b\"\n")), "same");
}

TEST(GateBaseline, AnOlderOneWithoutConditionsIsRefused) {
  const TempFolder folder;
  write_text(folder / "old.json", "{\"schema\": \"swarmcert/baseline/2\", \"values\": {}}");
  EXPECT_THROW(gate::read_baseline(folder / "old.json"), files::InputError);
}

TEST(GateCommand, WeakerConditionsFailUnlessTheBaselineIsUpdated) {
  const ReleaseFolder release;
  const std::string command =
      "swarmcert gate policy.toml -q --force --json gate.json --baseline baseline.json";
  const auto policy = [&](const std::string& facts, const std::string& more) {
    release.policy_of({"firmware_facts\n" + facts, "regression\nmax_increase_percent = 5" + more,
                       "certificate", "float32_error\nmax_error_gf = 1"});
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
  const files::Json json = files::parse_json(read_text(release / "gate.json"), "gate.json");
  ASSERT_EQ(json["changes"].size(), 1u) << json["changes"];
  EXPECT_EQ(json["changes"][0]["claim"], "stronger");
  EXPECT_EQ(json["changes"][0]["before"], 30000);
  policy("max_flash_bytes = 40000", "");
  expect(1,
         "firmware_facts.max_flash_bytes: 30000 before, 40000 now; firmware_facts.max_ram_bytes: 8192 "
         "before, none "
         "now");
  policy("max_flash_bytes = 30000\nmax_ram_bytes = 8192", "0");
  expect(1, "regression.max_increase_percent.others: 5 before, 50 now");
  release.policy_of(
      {"firmware_facts\nmax_flash_bytes = 30000\nmax_ram_bytes = 8192", "float32_error\nmax_error_gf = 1"});
  expect(1, "certificate: the check was dropped; regression: the check was dropped");

  // The files on which the judgement rests are conditions too.
  policy("max_flash_bytes = 30000\nmax_ram_bytes = 8192", "");
  const std::string box = read_text(release / "network/box.toml");
  for (const auto& [sizes, exit_code, word] :
       {std::tuple("[-1, -1, -1, -2, -2, -2.01]\nupper = [1, 1, 1, 2, 2, 2.01]", 0, "verdict: pass"),
        std::tuple("[-0.1, -0.1, -0.1, -0.1, -0.1, -0.1]\nupper = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1]", 1,
                   "box.phi")}) {
    write_text(release / "network/box.toml",
               std::string("schema = \"swarmcert/box/1\"\nlower = ") + sizes + "\n");
    expect(exit_code, word);
  }
  write_text(release / "network/box.toml", box);
  write_text(release / "model.toml", read_text(release / "model.toml") + "# lighter\n");
  expect(1, "inputs.model.model.toml");

  policy("max_flash_bytes = 40000", "");
  expect(0, "verdict: pass", " --update-baseline --bundle bundle");
  expect(0, "verdict: pass");
  EXPECT_EQ(release.run("swarmcert verify-bundle bundle -q").exit_code, 0);
}

TEST(GateCommand, WhatReleasedFilesSayOfVehicleUnitAndInputsIsAConditionToo) {
  const ReleaseFolder release;
  const std::string command = "swarmcert gate policy.toml -q --baseline baseline.json";
  const std::string start =
      "schema = \"swarmcert/policy/1\"\n[release]\nnetwork = \"network/network.toml\"\ngains = "
      "\"gains.toml\"\n"
      "model = \"model.toml\"\n";
  const std::string tables =
      "[range]\nmax_abs_force = 100\n[tracking]\namplitude_N = 0.001\nguard_factor = 1\nmax_error_m = "
      "10\nover = "
      "\"corners\"\n";
  const std::string gains = read_text(release / "gains.toml"),
                    network = read_text(release / "network/network.toml");
  const std::string with_lag = gains + "\n[lag]\nmotor_s = 0.05\n";
  const std::string clamped =
      network + "[input.clamp]\nlower = [-1, -1, -1, -2, -2, -2]\nupper = [1, 1, 1, 2, 2, 2]\n";
  const auto put = [&](const std::string& policy, const std::string& of_gains,
                       const std::string& of_network) {
    write_text(release / "policy.toml", policy);
    write_text(release / "gains.toml", of_gains);
    write_text(release / "network/network.toml", of_network);
  };
  put(start + tables, with_lag, clamped);
  ASSERT_EQ(release.run(command + " --update-baseline").exit_code, 0);
  ASSERT_EQ(release.run(command).exit_code, 0);
  std::string newton = clamped;
  newton.replace(newton.find("\"gf\""), 4, "\"N\"");
  const std::tuple<const char*, std::string, std::string, std::string> weaker[] = {
      {"vehicle.motor_lag_s: 0.05 before, 0 now", start + tables, gains, clamped},
      {"network.unit: gf before, N now", start + tables, with_lag, newton},
      {"box: all that the clamp lets through before", start + "box = \"network/box.toml\"\n" + tables,
       with_lag, clamped}};
  for (const auto& [word, policy, of_gains, of_network] : weaker) {
    put(policy, of_gains, of_network);
    const Outcome outcome = release.run(command);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
    EXPECT_NE(outcome.output.find(word), std::string::npos) << word << " in\n" << outcome.output;
  }
}

TEST(GateCommand, AnApprovedHashIsThatOfAReleasedFile) {
  const ReleaseFolder release;
  const std::string text = read_text(release / "gains.toml");
  write_text(release / "approved-gains.toml", text);
  release.policy_of({"hashes\n\"approved-gains.toml\" = \"" + files::sha256(text) + "\""});
  const Outcome outcome = release.run("swarmcert gate policy.toml -q");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
  EXPECT_NE(outcome.output.find("approved-gains.toml is not a file of this release"), std::string::npos)
      << outcome.output;
}

TEST(GateCommand, ADamagedBaselineOrAPipeIsRefusedBeforeAnyCheckAndABrokenPolicyLeavesEveryOutput) {
  const ReleaseFolder release;
  release.policy_of({"firmware_facts\nmax_flash_bytes = 30000"});
  const std::string outputs =
      " -q --force --junit gate.xml --sarif gate.sarif --markdown gate.md --json gate.json";
  write_text(release / "baseline.json", "{");
  const Outcome damaged = release.run("swarmcert gate policy.toml --baseline baseline.json" + outputs);
  EXPECT_EQ(damaged.exit_code, 3) << damaged.output;
  EXPECT_EQ(files::parse_json(read_text(release / "gate.json"), "gate.json")["checks"].size(), 1u)
      << "no check has run";

  for (const auto& [make, word] :
       {std::pair("mkfifo ", "is a pipe"), std::pair("ln -s /dev/zero ", "fail")}) {
    for (const std::string file :
         {"baseline.json", "facts.json", "network/network.toml", "policy.toml", "swarm.toml"}) {
      const ReleaseFolder other(release);
      std::filesystem::remove(other / file);
      const Outcome outcome =
          other.run(make + file + " && timeout 20 swarmcert gate policy.toml --baseline " +
                    (file == "baseline.json" ? file : "none.json --update-baseline"));
      EXPECT_EQ(outcome.exit_code, 3) << file << outcome.output;
      EXPECT_NE(outcome.output.find(word), std::string::npos) << file << outcome.output;
    }
  }

  write_text(release / "policy.toml", "schema = \"swarmcert/policy/1\"\n[release]\n\n[certificat]\n");
  const Outcome broken = release.run(
      "mkdir -p repository/.git repository/a && cp policy.toml repository/a && "
      "cd repository/a && swarmcert gate policy.toml" +
      outputs);
  EXPECT_EQ(broken.exit_code, 3) << broken.output;
  const std::string folder = release / "repository/a/";
  const files::Json place =
      files::parse_json(read_text(folder + "gate.sarif"),
                        "gate.sarif")["runs"][0]["results"][0]["locations"][0]["physicalLocation"];
  EXPECT_EQ(place["artifactLocation"]["uri"], "a/policy.toml") << "from the root of the repository";
  EXPECT_EQ(place["region"]["startLine"], 4);
  EXPECT_NE(read_text(folder + "gate.xml").find("file=\"a/policy.toml\" line=\"4\""), std::string::npos);
}

}  // namespace
}  // namespace swarmcert::tests

// Policies: which are rejected, with which line and hint; and the meaning of each check's limits.
#include "analysis/gate/policy.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "data.h"
#include "gate/release.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/refusal.h"

namespace swarmcert::tests {
namespace {

std::string refusal(const TempFolder& folder, const std::string& text) {
  write_text(folder / "policy.toml", text);
  try {
    gate::read_policy(folder / "policy.toml");
  } catch (const files::InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(GatePolicy, IsRefusedWithLineValueAndMend) {
  const TempFolder folder;
  const std::string head = "schema = \"swarmcert/policy/1\"\n[release]\nnetwork = \"n.toml\"\n";
  const struct {
    std::string text;
    std::vector<std::string> words;
  } cases[] = {
      {"schema = \"swarmcert/policy/2\"\n", {"line 1", "schema", "swarmcert/policy/1"}},
      {head, {"asks for no check"}},
      {head + "[lipshitz]\n", {"line 4", "lipshitz", "did you mean \"lipschitz\"?"}},
      {head + "[lipschitz]\nmax_jonit_gf = 3\n",
       {"line 5", "max_jonit_gf", "did you mean \"max_joint_gf\"?"}},
      {head + "[lipschitz]\n", {"line 4", "lipschitz", "states no limit", "max_joint_gf"}},
      {head + "[lipschitz]\nmax_joint_gf = \"much\"\n", {"line 5", "must be a number"}},
      {head + "[lipschitz]\nmax_joint_gf = nan\n", {"line 5", "must be finite"}},
      {head + "[lipschitz]\nmax_joint_gf = 3\nmax_joint_N = 3\n", {"states the limit twice"}},
      {head + "[certificate]\n", {"line 4", "does not name", "certificate"}},
      {head + "[match]\n", {"line 4", "source or elf"}},
      {head + "[certificate]\naccepted = true\n", {"line 5", "accepted", "is not a known key"}},
      {head + "gain = \"g.toml\"\n[spectral_norms]\n", {"line 4", "gain", "did you mean \"gains\"?"}},
      {head + "flights = [\"f\"]\n[spectral_norms]\n", {"logs", "how many"}},
      {head + "flights = []\n[spectral_norms]\n", {"line 4", "names no flight"}},
      {head + "gains = \"g\"\nmodel = \"m\"\n[tracking]\nmax_error_m = 0.1\n", {"line 6", "flights"}},
      {head + "gains = \"g\"\nmodel = \"m\"\n[tracking]\nmax_error_m = 1\nrate_N_s = -1\n",
       {"line 8", "negative"}},
      {head + "gains = \"g\"\nmodel = \"m\"\n[tracking]\nmax_error_m = 1\nrate_N_s = 1\nguard_factor = 0.9\n",
       {"line 9", "at least 1"}},
      {head + "gains = \"g\"\nmodel = \"m\"\nflights = [\"f\"]\nlogs = 1\n[tracking]\nmax_error_m = 1\n" +
           "guard_factor = 1\nguard_quantile = \"max\"\n",
       {"line 11", "guard_quantile", "conflicts"}},
      {head + "gains = \"g\"\nmodel = \"m\"\n[theorem]\nrate_N_s = 1\n",
       {"line 7", "rate_N_s", "max_ball_m"}},
      {head + "logs = 2\n[spectral_norms]\n", {"line 4", "logs", "flights"}},
      {head + "[hashes]\n\"n.toml\" = \"12\"\n", {"line 5", "SHA-256", "sha256sum"}},
      {head + "[regression]\n", {"line 4", "max_increase_percent"}},
      {"schema = \"swarmcert/policy/1\"\n[spectral_norms]\n", {"release", "is missing"}},
  };
  for (const auto& one : cases) {
    const std::string message = refusal(folder, one.text);
    for (const std::string& word : one.words)
      EXPECT_NE(message.find(word), std::string::npos) << word << " in\n" << message << "\nfor\n" << one.text;
  }
}

TEST(GateChecks, AValueJustBeyondItsLimitIsToldApartFromIt) {
  const auto reason = [](double attained) {
    gate::Limit limit;
    limit.value = 0.2573;
    gate::Check row = gate::row("lipschitz", limit);
    gate::judge(row, limit, 0.25730001, attained);
    EXPECT_NE(row.verdict, gate::Verdict::kPass);
    return row.reason;
  };
  EXPECT_EQ(reason(1), "0.25730001 is above 0.2573");
  EXPECT_EQ(reason(0), "0.25730001 does not prove at most 0.2573, and nothing refutes it");
}

TEST(GateChecks, APercentageOfARowThatDoesNotExistIsRefused) {
  const ReleaseFolder release;
  const auto outcome = [&](const std::string& row) {
    release.policy_of({"firmware_facts\nmax_flash_bytes = 40000",
                       "regression\nmax_increase_percent = 5\npercent_of = { \"" + row + "\" = 0 }"});
    return release.run("swarmcert gate policy.toml -q --baseline " + release.path() + "/baseline.json");
  };
  release.policy_of({"firmware_facts\nmax_flash_bytes = 40000", "regression\nmax_increase_percent = 5"});
  ASSERT_EQ(release.run("swarmcert gate policy.toml -q --baseline baseline.json --update-baseline").exit_code,
            0);
  EXPECT_EQ(outcome("firmware_facts.flash").exit_code, 0);
  const Outcome typo = outcome("firmware_facts.flahs");
  EXPECT_EQ(typo.exit_code, 3) << typo.output;
  EXPECT_NE(typo.output.find("did you mean \"firmware_facts.flash\"?"), std::string::npos) << typo.output;
}

TEST(GatePolicy, TheExampleThatShipsIsUnderstood) {
  const gate::Policy policy = gate::read_policy(source_path("analysis/gate/example.toml"));
  EXPECT_GE(policy.checks.size(), 8u);
}

TEST(GateChecks, LimitsInNewtonMeanTheSameAsInGramForce) {
  const ReleaseFolder release;
  const auto value = [&](const std::string& table, const std::string& name) {
    const gate::GateResult result = release.judge(release.policy_of({table}));
    for (const gate::Check& check : result.checks)
      if (check.name == name) return check.value.value_or(-1);
    return -1.0;
  };
  const std::pair<std::string, std::string> tables[] = {{"lipschitz\nmax_joint_", "lipschitz"},
                                                        {"float32_error\nmax_error_", "float32_error"},
                                                        {"range\nmax_abs_force_", "range"}};
  for (const auto& [table, name] : tables) {
    const double gf = value(table + "gf = 1000", name), newton = value(table + "N = 1000", name);
    EXPECT_GT(gf, 0);
    EXPECT_GE(newton, gf * 0.00981);  // rounded up
    EXPECT_NEAR(newton, gf * 0.00981, 1e-13 * gf);
  }
}

TEST(GateChecks, TheGuardFactorOfTheFlightsWidensTheMeasuredBound) {
  const ReleaseFolder release;
  // Flown with downwash, which the model lacks: the residual drives the loop again.
  std::filesystem::remove_all(release / "flights");
  const std::string source = SWARMCERT_SOURCE_DIR;
  ASSERT_EQ(release
                .run("swarmcert simulate swap --vehicles 2 --duration 15 -q --model " + source +
                     "/stability/models/crazyflie-small-effects.toml --gains gains.toml -o flights/1")
                .exit_code,
            0);
  const auto row_of = [&](const std::string& body) {
    return release.judge(release.policy_of({"tracking\nmax_error_m = 10\n" + body})).checks.at(0);
  };
  const gate::Check measured = row_of(""), bare = row_of("guard_factor = 1"),
                    wider = row_of("guard_factor = 3");
  ASSERT_EQ(measured.verdict, gate::Verdict::kPass) << measured.reason << measured.witness;
  EXPECT_GE(*measured.value, *bare.value);
  EXPECT_NEAR(*wider.value, 3 * *bare.value, 1e-12);
  EXPECT_NE(measured.witness.find("measured"), std::string::npos) << measured.witness;
  EXPECT_LT(
      *bare.value,
      *row_of("guard_factor = 1\nquantile = \"max\"\n[tracking.uncertainty]\nmass_kg = [0.03, 0.04]").value);
}

TEST(GateChecks, APromiseHasToHoldOnReferenceFlightsThatItWasNotMadeFrom) {
  const ReleaseFolder release;
  const auto row_of = [&](double bound_m, const std::string& made_from) {
    std::string rows;
    for (const std::string axis : {"x", "y", "z"}) {
      rows += std::string(rows.empty() ? "" : ", ") + R"({"axis": ")" + axis +
              R"(", "channel": "force", "loop": "sampled", "unit": "m", "total": )" +
              std::to_string(bound_m) + "}";
    }
    write_text(release / "bound.json",
               R"({"schema": "swarmcert/bound/1", "coverage": {"level": 0.9, "made_from": [)" + made_from +
                   R"(], "bounds": [)" + rows + "]}}");
    std::string text = read_text(release.policy_of(
        {"tracking\namplitude_N = 0.02\nguard_factor = 1.1\nmax_error_m = 10\nmin_promise_kept = 0.85"}));
    const std::size_t at = text.find("[release]\n") + 10;
    write_text(release / "policy.toml", text.insert(at, "promise = \"bound.json\"\n"));
    const gate::GateResult result = release.judge(release / "policy.toml");
    EXPECT_EQ(result.checks.size(), 2u);
    return result.checks.at(1);
  };
  const gate::Check wide = row_of(10, ""), narrow = row_of(1e-6, "");
  EXPECT_EQ(wide.name, "tracking.promise_kept");
  EXPECT_EQ(wide.verdict, gate::Verdict::kPass) << wide.reason;
  EXPECT_EQ(*wide.value, 1);
  EXPECT_NE(wide.witness.find("promised 0.9"), std::string::npos) << wide.witness;
  EXPECT_EQ(narrow.verdict, gate::Verdict::kFail);
  EXPECT_EQ(*narrow.value, 0);
  // Flights from which the promise was made do not count.
  std::string hashes;
  for (const std::string& file : release.files()) {
    if (file.rfind("flights/", 0) != 0) continue;
    hashes += std::string(hashes.empty() ? "" : ", ") + '"' + files::sha256(read_text(release / file)) + '"';
  }
  ASSERT_FALSE(hashes.empty());
  const gate::Check used = row_of(10, hashes);
  EXPECT_NE(used.verdict, gate::Verdict::kPass);
  EXPECT_NE(used.reason.find("made from the reference flights"), std::string::npos) << used.reason;
}

TEST(GateChecks, CornersPassForTheWholeBoxOnlyWhereThePolicySaysSo) {
  const ReleaseFolder release;
  std::filesystem::copy_file(source_path("controller/gains/crazyflie-small.toml"), release / "gains.toml",
                             std::filesystem::copy_options::overwrite_existing);
  const auto row_of = [&](const std::string& body) {
    return release.judge(release.policy_of({"tracking\namplitude_N = 0.01\nguard_factor = 1\n" + body}))
        .checks.at(0);
  };
  const gate::Check box = row_of("max_error_m = 10"),
                    corners = row_of("max_error_m = 10\nover = \"corners\"");
  EXPECT_EQ(box.verdict, gate::Verdict::kInconclusive) << box.reason;
  EXPECT_FALSE(box.value.has_value());
  EXPECT_EQ(corners.verdict, gate::Verdict::kPass) << corners.reason;
  EXPECT_NE(corners.witness.find("not enclosed"), std::string::npos) << corners.witness;
  EXPECT_EQ(row_of("max_error_m = 1e-4").verdict, gate::Verdict::kFail)
      << "a corner beyond the limit is enough";
}

TEST(GateChecks, ErrorsOfTheEstimatesCountAmongWhatMovesTheVehicle) {
  const ReleaseFolder release;
  const auto row_of = [&](const std::string& body) {
    return release
        .judge(
            release.policy_of({"tracking\namplitude_N = 0.01\nguard_factor = 1\nmax_error_m = 10\n" + body}))
        .checks.at(0);
  };
  const gate::Check without = row_of(""), velocity = row_of("velocity_error_m_s = 0.1"),
                    position = row_of("position_error_m = 0.01");
  ASSERT_TRUE(without.value && velocity.value && position.value);
  EXPECT_GT(*velocity.value, *without.value);
  EXPECT_GT(*position.value, *without.value);
  EXPECT_NE(velocity.witness.find("velocity error 0.1 m/s"), std::string::npos) << velocity.witness;
  EXPECT_TRUE(refuses([&] { row_of("velocity_error_m_s = -1"); },
                      {"policy.toml", "velocity_error_m_s", "-1", "must not be negative"}));
}

TEST(GateChecks, ALimitOfAFunctionThatNoNetworkCanHaveIsRefused) {
  const ReleaseFolder release;
  for (const std::string name : {"phi_small", "psi:small", "set:small"}) {
    const std::string table = "lipschitz\nfunctions = { \"" + name + "\" = 30 }";
    EXPECT_TRUE(refuses([&] { release.judge(release.policy_of({table})); },
                        {"policy.toml", name, "is not a function", "phi:<kind>"}))
        << name;
  }
}

TEST(GateChecks, AnUnstablePlantInTheBoxNeverPasses) {
  const ReleaseFolder release;
  const gate::GateResult result =
      release.judge(release.policy_of({"tracking\nmax_error_m = 1000\namplitude_N = 0.01\nguard_factor = "
                                       "1\nuncertainty = { lag_s = [0, 1] }"}));
  EXPECT_NE(result.checks.at(0).verdict, gate::Verdict::kPass) << told(result);
}

TEST(GateChecks, ACertificateOfFloat64WeightsIsNoneOfWhatFlies) {
  const ReleaseFolder release;
  for (const std::string part : {"phi", "rho"}) {
    const std::string path = release / ("network/" + part + ".safetensors");
    files::Weights weights = files::load_weights(path);
    weights.precision = files::Precision::kFloat64;
    for (files::Layer& layer : weights.layers)
      for (double& w : layer.weights) w *= 1 + 0x1p-40;
    files::save_safetensors(weights, path, true);
  }
  const std::string certify = "swarmcert certify network/network.toml --nodes 0 -q --force -o cert.json";
  ASSERT_EQ(release.run(certify).exit_code, 0);
  gate::GateResult result = release.judge(release.policy_of({"certificate"}));
  ASSERT_EQ(caught(result), std::vector<std::string>{"certificate"});
  EXPECT_NE(result.checks[0].reason.find("--as float32"), std::string::npos) << result.checks[0].reason;
  ASSERT_EQ(release.run(certify + " --as float32").exit_code, 0);
  result = release.judge(release.policy_of({"certificate"}));
  EXPECT_TRUE(caught(result).empty()) << told(result);
}

TEST(GateChecks, WhatRestsOnARejectedCertificateFailsUnlessThatIsJudgedByItself) {
  const ReleaseFolder release;
  std::string text = read_text(release / "cert.json");
  text.replace(text.find("\"lower\": "), 9, "\"lower\": 1");
  write_text(release / "cert.json", text);
  const std::string limit = "lipschitz\nmax_joint_gf = 1000";
  EXPECT_EQ(caught(release.judge(release.policy_of({limit}))), std::vector<std::string>{"lipschitz"});
  EXPECT_EQ(caught(release.judge(release.policy_of({"certificate", limit}))),
            std::vector<std::string>{"certificate"});
}

TEST(GateCommand, InconclusiveFailsUnlessItIsAllowed) {
  const ReleaseFolder release;
  // The limit lies between the attained slope and the proved bound.
  const gate::Check check =
      release.judge(release.policy_of({"float32_error\nmax_error_gf = 1e-12"})).checks.at(0);
  EXPECT_EQ(check.verdict, gate::Verdict::kInconclusive);
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q").exit_code, 1);
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --allow-inconclusive").exit_code, 0);
  EXPECT_EQ(release.run("swarmcert gate nothing.toml -q").exit_code, 3);
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --github --json -").exit_code, 2);
}

TEST(GateCommand, SameBytesForAnyNumberOfThreadsAndWhereverOutputGoes) {
  const ReleaseFolder release;
  release.policy({{"regression", ""}});
  ASSERT_EQ(release.run("swarmcert gate policy.toml -q -j1 --json a.json").exit_code, 0);
  ASSERT_EQ(release.run("swarmcert gate policy.toml -q -j3 --junit x.xml --json b.json").exit_code, 0);
  EXPECT_EQ(read_text(release / "a.json"), read_text(release / "b.json"));
}

TEST(GateCommand, ABaselineIsReplacedOnlyByAReleaseThatPasses) {
  const ReleaseFolder release;
  release.policy({{"regression", "max_increase_percent = 5"}});
  const std::string command = "swarmcert gate policy.toml -q --baseline old.json";
  EXPECT_EQ(release.run(command).exit_code, 3) << "no baseline to compare with";
  release.write_facts(70000);
  EXPECT_EQ(release.run(command + " --update-baseline").exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(release / "old.json"));
  release.write_facts(21000);
  EXPECT_EQ(release.run(command + " --update-baseline").exit_code, 0);
  const std::string first = read_text(release / "old.json");
  release.write_facts(30000);  // within its limit, but 43 % worse
  const Outcome worse = release.run(command);
  EXPECT_EQ(worse.exit_code, 1);
  EXPECT_NE(worse.output.find("firmware_facts.flash: 21000 before, 30000 now"), std::string::npos)
      << worse.output;
  EXPECT_EQ(read_text(release / "old.json"), first);
  release.run(command + " --update-baseline");
  EXPECT_EQ(release.run(command).exit_code, 0) << "accepted as the new baseline";
}

TEST(GateCommand, ABundleHoldsTheBaselineThatTheReleaseWasHeldAgainst) {
  const ReleaseFolder release;
  release.policy({{"regression", "max_increase_percent = 5"}});
  const std::string command = "swarmcert gate policy.toml -q --baseline old.json --update-baseline";
  ASSERT_EQ(release.run(command).exit_code, 0);
  const std::string before = read_text(release / "old.json");
  release.write_facts(21500);  // 2 % more than before
  const Outcome bundled = release.run(command + " --bundle bundle");
  ASSERT_EQ(bundled.exit_code, 0) << bundled.output;
  EXPECT_NE(read_text(release / "old.json"), before) << "replaced";
  EXPECT_EQ(read_text(release / "bundle/files/old.json"), before);
  EXPECT_EQ(release.run("swarmcert verify-bundle bundle --rerun -q").exit_code, 0);
}

}  // namespace
}  // namespace swarmcert::tests

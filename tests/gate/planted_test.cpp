// A good release passes; a release that violates one kind of check is caught by that check and no other.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>

#include "analysis/gate/baseline.h"
#include "gate/release.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

using Names = std::vector<std::string>;

void replace(const std::string& path, const std::string& from, const std::string& to) {
  std::string text = read_text(path);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << path << " has no " << from;
  write_text(path, text.replace(at, from.size(), to));
}

/// A fault: after `plant`, the release is caught by exactly `check`, and the command line exits with 1. A fault in a
/// file that is a condition of the judgement also shows against the baseline.
struct Plant {
  std::string check;
  std::function<void(const ReleaseFolder&)> plant;
  bool is_in_a_condition = false;
};

TEST(Gate, AGoodReleasePassesAndEachPlantedViolationIsCaughtByItsOwnCheckAlone) {
  const ReleaseFolder good;
  const std::string baseline = good / "baseline.json";
  const Outcome first =
      good.run("swarmcert gate " + good.policy() + " -q --baseline baseline.json --update-baseline");
  ASSERT_EQ(first.exit_code, 0) << first.output;
  const Outcome second = good.run("swarmcert gate policy.toml -q --baseline baseline.json --json gate.json");
  ASSERT_EQ(second.exit_code, 0) << second.output;
  EXPECT_NE(second.output.find("verdict: pass"), std::string::npos) << second.output;
  const files::Json json = files::parse_json(read_text(good / "gate.json"), "gate.json", "swarmcert/gate/1");
  std::size_t with_baseline = 0;
  for (const files::Json& check : json["checks"]) {
    EXPECT_EQ(check["verdict"], "pass") << check;
    EXPECT_GT(check["line"].get<int>(), 1) << check;
    if (check["baseline"].is_number()) ++with_baseline;
  }
  EXPECT_GE(with_baseline, 15u);

  // Every table of the policy rejects one of these faults: slightly more than 64 KiB of `flash`, a displaced flight,
  // and so on.
  const std::string gains =
      "schema = \"swarmcert/gains/1\"\n[position]\nLambda = [4, 4, 4]\nK = [0.136, 0.136, 0.136]\n";
  const std::vector<Plant> plants = {
      {"hashes",
       [](const ReleaseFolder& release) {
         std::ofstream(release / "gains.toml", std::ios::app) << "# tuned\n";
       }},
      {"certificate",
       [](const ReleaseFolder& release) { replace(release / "cert.json", "\"lower\": ", "\"lower\": 1"); }},
      {"lipschitz",
       [](const ReleaseFolder& release) {
         change_tensor(release / "network/rho.safetensors", "fc2", 2.2);
         release.certify_again();
       }},
      {"spectral_norms",
       [](const ReleaseFolder& release) {
         change_tensor(release / "network/phi.safetensors", "fc2", 1.7);
         change_tensor(release / "network/rho.safetensors", "fc1", 1 / 1.7);
         release.certify_again();
       }},
      {"float32_error",
       [](const ReleaseFolder& release) {
         write_text(release / "network/box.toml",
                    "schema = \"swarmcert/box/1\"\nlower = [-10, -10, -10, -20, -20, -20]\nupper = [10, 10, "
                    "10, 20, 20, 20]\n");
       }},
      {"range",
       [](const ReleaseFolder& release) {
         change_tensor(release / "network/rho.safetensors", "fc2", 1, 100);
         release.certify_again();
       }},
      {"theorem",
       [gains](const ReleaseFolder& release) {
         write_text(release / "gains.toml", gains + "[lag]\nmotor_s = 0.001\n");
       },
       true},
      {"tracking",
       [](const ReleaseFolder& release) {
         write_text(release / "gains.toml",
                    "schema = \"swarmcert/gains/1\"\n[position]\nLambda = [3.2, 3.2, 3.2]\nK = [0.109, "
                    "0.109, 0.109]\n");
       }},
      {"small_gain",
       [](const ReleaseFolder& release) {
         replace(release / "swarm.toml", "position_N_m = 0.145", "position_N_m = 0.9");
       },
       true},
      {"match",
       [](const ReleaseFolder& release) {
         const std::string path = release / "firmware/swarmcert_network.cpp";
         std::string source = read_text(path);
         const std::size_t digit = source.find("p-", source.find("swarmcert_rho_small_2 = {")) - 1;
         source[digit] = source[digit] == '2' ? '4' : '2';
         write_text(path, source);
       }},
      {"firmware_facts", [](const ReleaseFolder& release) { release.write_facts(70000); }},
      {"residual",
       [](const ReleaseFolder& release) {
         std::ofstream(release / "pushed.toml")
             << read_text(release / "model.toml")
             << "\n[[effect]]\nname = \"constant_force\"\n"
                "parameters = { force_x_N = 0.05, force_y_N = 0, force_z_N = 0 }\n";
         const Outcome flown = release.run(
             "swarmcert simulate random-walk --vehicles 1 --duration 12 --model pushed.toml --gains "
             "gains.toml -q --force --seed 1 -o flights/1");
         EXPECT_EQ(flown.exit_code, 0) << flown.output;
       },
       true},
      {"regression",
       [](const ReleaseFolder& release) {
         files::Json old = files::parse_json(read_text(release / "gate.json"), "gate.json");
         gate::Checks checks;
         for (const files::Json& check : old["checks"]) {
           if (!check["value"].is_number()) continue;
           gate::Check one = gate::row(check["name"].get<std::string>(), 1);
           one.value = check["value"].get<double>() * (one.name == "float32_error" ? 0.04 : 1);
           checks.push_back(one);
         }
         gate::write_baseline(release / "baseline.json", checks);
       }},
  };
  std::vector<std::string> kinds;
  for (const gate::CheckKind& kind : gate::check_kinds()) kinds.emplace_back(kind.name);
  int caught_alone = 0;
  for (const Plant& plant : plants) {
    SCOPED_TRACE(plant.check);
    kinds.erase(std::find(kinds.begin(), kinds.end(), plant.check));
    const ReleaseFolder release(good);
    // The approved hash is that of the modified file, unless the hash is the planted fault.
    const std::string approved = release.policy();
    plant.plant(release);
    const std::string policy = plant.check == "hashes" ? approved : release.policy();
    const Outcome outcome =
        release.run("swarmcert gate policy.toml -q --baseline baseline.json --force --json out.json");
    EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
    const files::Json result = files::parse_json(read_text(release / "out.json"), "out.json");
    Names names;
    for (const files::Json& check : result["checks"]) {
      if (check["verdict"] == "pass") continue;
      const auto name = check["name"].get<std::string>();
      const std::string table = name.substr(0, name.find('.'));
      EXPECT_FALSE(check["reason"].get<std::string>().empty()) << check;
      if (std::find(names.begin(), names.end(), table) == names.end()) names.push_back(table);
    }
    Names expected = {plant.check};
    if (plant.is_in_a_condition) expected.emplace_back("regression");
    EXPECT_EQ(names, expected) << outcome.output;
    if (names == expected) ++caught_alone;
  }
  EXPECT_TRUE(kinds.empty()) << "no violation of " << kinds.front() << " is planted";
  std::printf("planted violations: %zu, caught by their own check alone: %d\n", plants.size(), caught_alone);
}

}  // namespace
}  // namespace swarmcert::tests

// A network as written by train, with compositions in which it is silent, goes through the gate like any other.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "data.h"
#include "gate/release.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

using files::Json;

/// Trained on recorded flights of two and of three vehicles, in which one composition is better off without a
/// network; its certificate with ranges, its source, and a policy with limits slightly above the proved values.
class SilentRelease {
 public:
  SilentRelease() {
    const std::string flights = data_path("flights/development/");
    const Outcome trained = run("swarmcert train '" + source_path("stability/models/crazyflie-small.toml") +
                                "' '" + source_path("stability/models/crazyflie-large.toml") + "' '" +
                                flights + "21_swap_sl' '" + flights +
                                "21_swap_ssl' --folds 2 --epochs 4 --phi 4 --rho 4 --features 3 --rate 2e-2 "
                                "-q -o net --json train.json");
    EXPECT_EQ(trained.exit_code, 0) << trained.output;
    write_text(
        folder_ / "box.toml",
        "schema = \"swarmcert/box/1\"\nlower = [-0.5, -0.5, -0.7, -1, -1, -1]\nupper = [0.5, 0.5, 0.7, 1, "
        "1, 1]\nground = { lower = [-1.5, -1, -1, -1], upper = [0, 1, 1, 1] }\n");
    certify_and_export();
    write_policy();
  }

  std::string operator/(const std::string& name) const { return folder_ / name; }
  Outcome run(const std::string& command) const { return run_shell(command, folder_.path()); }

  void certify_and_export() const {
    const Outcome outcome =
        run("swarmcert certify net/network.toml --domain box.toml --nodes 1 --range-nodes 100 -q --force -o "
            "box-cert.json --json certify.json && swarmcert certify net/network.toml --nodes 1 -q --force -o "
            "cert.json && swarmcert export net/network.toml --certificate cert.json -q --force -o firmware");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  }

  /// The largest number of a member of certify's JSON.
  double largest(const std::string& list, const std::string& member) const {
    const Json json = files::read_json(folder_ / "certify.json", "swarmcert/certify/1");
    double most = 0;
    for (const Json& one : json[list])
      if (list != "bounds" || one["function"].get<std::string>().rfind("set:", 0) == 0)
        most = std::max(most, one[member].get<double>());
    return most;
  }

  void write_policy() const {
    const auto limit = [&](const std::string& list, const std::string& member, double more = 1.05) {
      return fmt::format("{:.9e}", more * largest(list, member));
    };
    write_text(folder_ / "policy.toml",
               "schema = \"swarmcert/policy/1\"\n[release]\nnetwork = \"net/network.toml\"\ncertificate = "
               "\"cert.json\"\nbox = \"box.toml\"\nsource = \"firmware/swarmcert_network.cpp\"\n"
               "[certificate]\n[spectral_norms]\n[match]\n"
               "[lipschitz]\nmax_joint_gf = " +
                   limit("bounds", "upper") +
                   "\n[float32_error]\nmax_error_gf = " + limit("float32_error", "bound", 100) +
                   "\n[range]\nmax_abs_force_gf = " + limit("range", "largest_magnitude") +
                   "\nmax_jump_gf = " + limit("range", "cut_off_jump") + "\n");
  }

  gate::GateResult judge() const {
    gate::GateSettings settings;
    settings.jobs = 1;
    return gate::run_gate(gate::read_policy(folder_ / "policy.toml"), settings);
  }

 private:
  TempFolder folder_;
};

TEST(Gate, ATrainedReleaseWithSilentCompositionsPassesAndPlantedFaultsInItAreCaught) {
  SWARMCERT_NEEDS_DATA();
  const SilentRelease release;
  const std::string network = read_text(release / "net/network.toml");
  const Json trained = files::read_json(release / "train.json", "swarmcert/train/1");
  ASSERT_FALSE(trained["silent"].empty()) << network;
  EXPECT_EQ(release.run("swarmcert check box-cert.json net/network.toml").exit_code, 0);
  const Outcome good = release.run("swarmcert gate policy.toml -q");
  EXPECT_EQ(good.exit_code, 0) << good.output;

  // Removes a silent composition, although the flights showed that the network does not help there.
  const std::size_t begin = network.find("silent = ");
  ASSERT_NE(begin, std::string::npos);
  std::string spoken = network;
  write_text(release / "net/network.toml", spoken.erase(begin, network.find('\n', begin) + 1 - begin));
  const std::vector<std::string> names = caught(release.judge());
  for (const std::string check : {"certificate", "match"})
    EXPECT_EQ(std::count(names.begin(), names.end(), check), 1) << check;
  write_text(release / "net/network.toml", network);

  // The force of a large vehicle is near 40 gf except in the composition where it is 0: both the range and the jump
  // change.
  change_tensor(release / "net/rho_large.safetensors", "fc2", 1, 40);
  std::filesystem::remove(release / "net/samples.json");  // of the network before the change
  release.certify_and_export();
  const gate::GateResult pushed = release.judge();
  EXPECT_EQ(caught(pushed), std::vector<std::string>{"range"}) << told(pushed);
  for (const gate::Check& check : pushed.checks) {
    EXPECT_TRUE(check.name != "range" || check.verdict == gate::Verdict::kFail) << told(pushed);
    EXPECT_TRUE(check.name != "range.jump" || check.value.value() > 39) << told(pushed);
  }
}

}  // namespace
}  // namespace swarmcert::tests

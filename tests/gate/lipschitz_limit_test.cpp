// Limits on Lipschitz constants hold for every function of the network, and on a box also by bounds over all inputs.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <random>

#include "analysis/run.h"
#include "nn/base/content_hash.h"
#include "nn/base/json.h"
#include "nn/random_network.h"
#include "nn/temp_folder.h"
#include "nn/weights/safetensors.h"

namespace swarmcert::tests {
namespace {

using files::Json;

/// A network with two kinds of neighbours and boxes of two sizes.
class TwoKinds {
 public:
  TwoKinds() {
    std::mt19937 generator(7);
    files::save_safetensors(random_network({6, 4, 2}, generator), folder_ / "phi.safetensors", false);
    files::save_safetensors(random_network({2, 4, 1}, generator), folder_ / "rho.safetensors", false);
    write_text(
        folder_ / "network.toml",
        "schema = \"swarmcert/network/1\"\noutput = { quantity = \"force_z\", unit = \"gf\" }\n"
        "[input]\norder = [\"dp_x_m\", \"dp_y_m\", \"dp_z_m\", \"dv_x_m_s\", \"dv_y_m_s\", \"dv_z_m_s\"]\n"
        "[phi.small]\nweights = \"phi.safetensors\"\n[phi.large]\nweights = \"phi.safetensors\"\n"
        "[rho.small]\nweights = \"rho.safetensors\"\n");
    write_text(folder_ / "box1.toml", cube(1));
    write_text(folder_ / "box2.toml", cube(2));
  }

  static std::string cube(double half) {
    return fmt::format(
        "schema = \"swarmcert/box/1\"\nlower = [-{0}, -{0}, -{0}, -{0}, -{0}, -{0}]\nupper = [{0}, {0}, {0}, "
        "{0}, {0}, {0}]\n",
        half);
  }

  std::string operator/(const std::string& name) const { return folder_ / name; }

  void certify(const std::string& options) const {
    const Outcome outcome = run_shell(
        "swarmcert certify network.toml --nodes 2 -q --force -o cert.json" + options, folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  }

  Outcome judge(const std::string& lipschitz) const {
    write_text(folder_ / "policy.toml",
               "schema = \"swarmcert/policy/1\"\n[release]\nnetwork = \"network.toml\"\ncertificate = "
               "\"cert.json\"\nbox = \"box1.toml\"\n[certificate]\n[lipschitz]\n" +
                   lipschitz);
    return run_shell("swarmcert gate policy.toml -q", folder_.path());
  }

 private:
  TempFolder folder_;
};

TEST(Gate, ALimitIsNotKeptByACertificateThatLacksABoundOfOneSetFunction) {
  const TwoKinds release;
  release.certify("");
  EXPECT_EQ(release.judge("max_joint_gf = 1000").exit_code, 0);
  Json certificate =
      files::parse_json(read_text(release / "cert.json"), "cert.json", "swarmcert/certificate/2");
  Json kept = Json::array();
  for (const Json& bound : certificate["bounds"])
    if (bound["function"] != "set:large:small") kept.push_back(bound);
  ASSERT_EQ(kept.size() + 1, certificate["bounds"].size());
  certificate["bounds"] = kept;
  certificate["content_sha256"] = files::content_sha256(certificate);
  write_text(release / "cert.json", certificate.dump());
  const Outcome outcome = release.judge("max_joint_gf = 1000");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("no global bound of set:large:small"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("pass"), std::string::npos)
      << outcome.output;  // the certificate itself is true
}

TEST(Gate, ALimitOnTheBoxIsKeptByABoundOverAllInputsAndNotRefutedByASlopeOutsideTheBox) {
  const TwoKinds release;
  release.certify("");
  EXPECT_EQ(release.judge("domain = \"box\"\nmax_joint_gf = 1000").exit_code, 0);
  EXPECT_NE(release.judge("max_joint_gf = 0.01").output.find("is above 0.01"), std::string::npos);
  const Outcome open = release.judge("domain = \"box\"\nmax_joint_gf = 0.01");
  EXPECT_EQ(open.exit_code, 1);
  EXPECT_NE(open.output.find("does not prove at most 0.01"), std::string::npos) << open.output;
  EXPECT_NE(open.output.find("--method branch --domain"), std::string::npos) << open.output;
}

TEST(Gate, ABoundOnABoxCountsOnlyIfItsBoxContainsThatOfTheRelease) {
  const TwoKinds release;
  release.certify(" --range-nodes 1 --domain box2.toml");
  EXPECT_EQ(release.judge("domain = \"box\"\nmax_joint_gf = 1000").exit_code, 0);
  EXPECT_NE(release.judge("max_joint_gf = 1000").output.find("certify without --domain"), std::string::npos);
  write_text(release / "box2.toml", TwoKinds::cube(0.5));
  release.certify(" --range-nodes 1 --domain box2.toml");
  const Outcome outside = release.judge("domain = \"box\"\nmax_joint_gf = 1000");
  EXPECT_EQ(outside.exit_code, 1);
  EXPECT_NE(outside.output.find("does not contain the release's"), std::string::npos) << outside.output;
}

}  // namespace
}  // namespace swarmcert::tests

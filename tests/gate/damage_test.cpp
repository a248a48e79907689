// A file of the release that is missing, damaged or replaced never passes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "analysis/gate/baseline.h"
#include "gate/release.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/random.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

/// The checks that read a file, cheapest first.
std::string table_for(const std::string& file) {
  if (file.rfind("flights/", 0) == 0) return "residual\nmax_rmse_N = 10";
  if (file.rfind("firmware/", 0) == 0) return "match";
  const std::map<std::string, std::string> tables = {
      {"network/box.toml", "float32_error\nmax_error_gf = 1000"},
      {"gains.toml", "theorem"},
      {"model.toml", "theorem"},
      {"swarm.toml", "small_gain\nmin_margin = 0"},
      {"facts.json", "firmware_facts\nmax_flash_bytes = 65536"},
  };
  const auto found = tables.find(file);
  return found == tables.end() ? "certificate" : found->second;
}

bool passes(const ReleaseFolder& release, const std::string& policy) {
  try {
    return exit_code(release.judge(policy), true) == 0;
  } catch (const files::InputError&) {
    return false;
  }
}

/// Changes every file of a release so that it differs from that of the first release.
void make_other(const ReleaseFolder& other) {
  change_tensor(other / "network/phi.safetensors", "fc1", 0.9);
  change_tensor(other / "network/rho.safetensors", "fc1", 0.9);
  for (const std::string file :
       {"network/network.toml", "network/box.toml", "gains.toml", "model.toml", "swarm.toml"})
    write_text(other / file, read_text(other / file) + "# another release\n");
  other.certify_again();
  other.write_facts(22000);
  EXPECT_EQ(
      other
          .run("swarmcert simulate random-walk --vehicles 1 --duration 12 --model model.toml --gains "
               "gains.toml -q --force --seed 3 -o flights/1 && swarmcert simulate random-walk --vehicles 1 "
               "--duration 12 --model model.toml --gains gains.toml -q --force --seed 4 -o flights/2")
          .exit_code,
      0);
}

TEST(GateInputs, AMissingDamagedOrSwappedFileNeverPasses) {
  const ReleaseFolder release, other;
  make_other(other);
  const std::vector<std::string> files = release.files();
  EXPECT_GE(files.size(), release.has_elf() ? 18u : 17u);
  files::Random random(5);
  int tried = 0, refused = 0;
  std::map<std::string, int> by_kind;
  for (const std::string& file : files) {
    const std::string path = release / file, good = read_text(path);
    const std::string table = table_for(file);
    const std::string plain = release.policy_of({table});
    ASSERT_TRUE(passes(release, plain)) << file << "\n" << told(release.judge(plain));
    // For gains, models and logs only the hashes in the policy determine which files are right.
    const std::string hashes = "hashes\n\"" + file + "\" = \"" + files::sha256(good) + "\"";
    const auto expect_refused = [&](const std::string& kind, bool is_pinned) {
      const std::string policy = is_pinned ? release.policy_of({hashes, table}) : release.policy_of({table});
      ++tried;
      ++by_kind[kind];
      const bool passed = passes(release, policy);
      EXPECT_FALSE(passed) << file << " " << kind;
      if (!passed) ++refused;
    };
    fs::remove(path);
    expect_refused("missing", false);
    fs::create_directory(path);
    expect_refused("folder", false);
    fs::remove(path);
    write_text(path, "");
    expect_refused("empty", false);
    std::string noise(good.size(), '\0');
    for (char& byte : noise) byte = static_cast<char>(random.bits() >> 56);
    write_text(path, noise);
    expect_refused("noise", false);
    for (int k = 0; k < 4; ++k) {
      std::string flipped = good;
      flipped[static_cast<std::size_t>(random.bits() % good.size())] ^=
          static_cast<char>(1 << (random.bits() % 8));
      write_text(path, flipped);
      expect_refused("one bit", true);
    }
    write_text(path, good.substr(0, good.size() / 2));
    expect_refused("cut", true);
    write_text(path, good + "\n");
    expect_refused("longer", true);
    const bool is_evaluator = file.rfind("firmware/nn/", 0) == 0;  // identical in every release
    EXPECT_EQ(read_text(other / file) == good, is_evaluator) << file;
    if (is_evaluator) {
      write_text(path, good);
      continue;
    }
    write_text(path, read_text(other / file));
    expect_refused("swapped", true);
    const bool is_tied = table == "certificate" || table == "match" || table.rfind("firmware_facts", 0) == 0;
    if (is_tied) expect_refused("swapped, not pinned", false);
    write_text(path, good);
  }
  std::printf("files of a release: %zu; bad inputs tried: %d, refused: %d (", files.size(), tried, refused);
  for (const auto& [kind, count] : by_kind) std::printf(" %s %d;", kind.c_str(), count);
  std::printf(" )\n");
}

TEST(GateInputs, ABaselineThatIsMissingOrEditedNeverPasses) {
  const ReleaseFolder release;
  const std::string policy =
      release.policy_of({"firmware_facts\nmax_flash_bytes = 65536", "regression\nmax_increase_percent = 5"});
  const std::string path = release / "baseline.json";
  gate::Check check = gate::row("firmware_facts.flash", 1);
  check.value = 21000;
  gate::write_baseline(path, {check});
  const std::string good = read_text(path);
  ASSERT_EQ(exit_code(release.judge(policy, path), false), 0) << told(release.judge(policy, path));
  int tried = 0, refused = 0;
  const auto expect_refused = [&] {
    ++tried;
    const bool passed = exit_code(release.judge(policy, path), true) == 0;
    EXPECT_FALSE(passed) << read_text(path);
    if (!passed) ++refused;
  };
  fs::remove(path);
  expect_refused();
  for (std::size_t at = 0; at < good.size(); ++at) {
    if (std::isspace(static_cast<unsigned char>(good[at])) != 0) continue;  // white space is not content
    std::string damaged = good;
    damaged[at] = damaged[at] == '9' ? '8' : static_cast<char>(damaged[at] + 1);
    if (files::sha256(damaged) == files::sha256(good)) continue;
    write_text(path, damaged);
    expect_refused();
  }
  gate::write_baseline(path, {});
  expect_refused();
  std::printf("damaged baselines tried: %d, refused: %d\n", tried, refused);
}

}  // namespace
}  // namespace swarmcert::tests

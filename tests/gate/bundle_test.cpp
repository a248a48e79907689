// A bundle is accepted as written, in any place; with any byte changed, or a file missing, added or swapped, it is
// rejected.
#include "analysis/gate/bundle.h"

#include <gtest/gtest.h>

#include "gate/release.h"
#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/base/random.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

/// Runs verify_bundle() and returns the reason for rejection.
std::string rejection(const std::string& folder, bool rerun = false) {
  const gate::BundleVerdict verdict = gate::verify_bundle(folder, rerun, {1, "", false, {}});
  return verdict.accepted ? "" : verdict.reason;
}

std::vector<std::string> files_of(const std::string& folder) {
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(folder).string());
  std::sort(files.begin(), files.end());
  return files;
}

/// Replaces a file and states its new hash in the manifest, so that only the checker and the match can detect it.
void forge(const std::string& folder, const std::string& file, const std::string& bytes) {
  write_text(folder + "/" + file, bytes);
  files::Json manifest = files::parse_json(read_text(folder + "/manifest.json"), "manifest.json");
  for (files::Json& entry : manifest["files"]) {
    if (entry["path"] != file) continue;
    entry["bytes"] = bytes.size();
    entry["sha256"] = files::sha256(bytes);
  }
  manifest["content_sha256"] = files::content_sha256(manifest);
  write_text(folder + "/manifest.json", files::to_text(manifest));
}

TEST(GateBundle, IsAcceptedAsWrittenAndRejectedWithAnyFileChangedMissingAddedOrSwapped) {
  const ReleaseFolder release;
  release.policy({{"regression", ""}});
  const Outcome written = release.run("swarmcert gate policy.toml -q --bundle bundle");
  ASSERT_EQ(written.exit_code, 0) << written.output;
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --bundle bundle").exit_code, 3)
      << "nothing is overwritten";
  // In another place, without the release: the bundle is self-contained.
  const TempFolder elsewhere;
  const std::string bundle = elsewhere / "bundle";
  fs::rename(release / "bundle", bundle);
  for (const fs::directory_entry& entry : fs::directory_iterator(release.path()))
    fs::remove_all(entry.path());
  ASSERT_EQ(rejection(bundle, true), "");
  EXPECT_EQ(run_shell("swarmcert verify-bundle bundle -q --json v.json", elsewhere.path()).exit_code, 0);
  const std::string sha256 = files::sha256(read_text(bundle + "/manifest.json"));
  EXPECT_EQ(run_shell("swarmcert verify-bundle bundle -q --sha256 " + sha256, elsewhere.path()).exit_code, 0);
  EXPECT_EQ(run_shell("swarmcert verify-bundle bundle -q --sha256 12", elsewhere.path()).exit_code, 1);

  const std::vector<std::string> files = files_of(bundle);
  files::Random random(9);
  int injected = 0, caught = 0;
  const auto expect_rejected = [&](const std::string& what) {
    ++injected;
    const std::string reason = rejection(bundle);
    EXPECT_FALSE(reason.empty()) << what;
    if (!reason.empty()) ++caught;
  };
  for (std::size_t k = 0; k < files.size(); ++k) {
    const std::string path = bundle + "/" + files[k], good = read_text(path);
    for (int i = 0; i < 8; ++i) {
      std::string damaged = good;
      damaged[static_cast<std::size_t>(random.bits() % good.size())] ^=
          static_cast<char>(1 << (random.bits() % 8));
      write_text(path, damaged);
      expect_rejected(files[k] + ", one bit");
    }
    write_text(path, good + " ");
    expect_rejected(files[k] + ", longer");
    write_text(path, good.substr(0, good.size() - 1));
    expect_rejected(files[k] + ", shorter");
    fs::remove(path);
    expect_rejected(files[k] + ", missing");
    fs::create_symlink("/dev/null", path);
    expect_rejected(files[k] + ", a link");
    fs::remove(path);
    const std::string next = bundle + "/" + files[(k + 1) % files.size()], of_next = read_text(next);
    write_text(path, of_next);
    write_text(next, good);
    expect_rejected(files[k] + ", swapped");
    write_text(path, good);
    write_text(next, of_next);
    write_text(path + ".extra", "more");
    expect_rejected(files[k] + ", a file beside it");
    fs::remove(path + ".extra");
  }
  fs::create_directory(bundle + "/empty");
  expect_rejected("an empty folder");
  fs::remove(bundle + "/empty");
  ASSERT_EQ(rejection(bundle), "") << "the test did not restore the bundle";
  std::printf("files of a bundle: %zu; faults injected: %d, caught: %d\n", files.size(), injected, caught);
}

TEST(GateBundle, AForgedManifestDoesNotHideOtherWeightsCertificateSourceOrVerdict) {
  const ReleaseFolder release;
  release.policy_of({"certificate", "match"});
  ASSERT_EQ(release.run("swarmcert gate policy.toml -q --bundle bundle").exit_code, 0);
  const std::string bundle = release / "bundle";
  const ReleaseFolder other;
  change_tensor(other / "network/rho.safetensors", "fc2", 0.9);
  other.certify_again();
  std::vector<std::string> forged = {"cert.json", "network/rho.safetensors",
                                     "firmware/swarmcert_network.cpp"};
  if (release.has_elf()) forged.emplace_back("firmware/network.elf");
  int caught = 0;
  for (const std::string& file : forged) {
    const std::string good = read_text(bundle + "/files/" + file),
                      manifest = read_text(bundle + "/manifest.json");
    forge(bundle, "files/" + file, read_text(other / file));
    EXPECT_NE(rejection(bundle), "") << file;
    if (!rejection(bundle).empty()) ++caught;
    write_text(bundle + "/files/" + file, good);
    write_text(bundle + "/manifest.json", manifest);
  }
  ASSERT_EQ(rejection(bundle), "");
  std::string result = read_text(bundle + "/gate.json");
  result.replace(result.find("\"verdict\": \"pass\""), 17, "\"verdict\": \"fail\"");
  forge(bundle, "gate.json", result);
  EXPECT_NE(rejection(bundle), "");
  for (const std::string path : {"../../x", "/etc/passwd", "files/../files/gains.toml", ""}) {
    files::Json manifest = files::parse_json(read_text(bundle + "/manifest.json"), "manifest.json");
    manifest["files"][0]["path"] = path;
    manifest["content_sha256"] = files::content_sha256(manifest);
    write_text(bundle + "/manifest.json", files::to_text(manifest));
    EXPECT_NE(rejection(bundle).find("not a path inside"), std::string::npos) << path << rejection(bundle);
  }
  std::printf("forged manifests: %zu, caught by the checker or the match: %d\n", forged.size(), caught);
}

TEST(GateBundle, OfAReleaseThatFailsOrPointsOutsideIsNotWritten) {
  const ReleaseFolder release;
  release.policy_of({"firmware_facts\nmax_flash_bytes = 1"});
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --bundle b").exit_code, 1);
  EXPECT_FALSE(fs::exists(release / "b"));
  std::string policy = read_text(release.policy_of({"certificate"}));
  policy.replace(policy.find("\"cert.json\""), 11, "\"" + (release / "cert.json") + "\"");
  write_text(release / "policy.toml", policy);
  const Outcome outcome = release.run("swarmcert gate policy.toml -q --bundle b");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("relative"), std::string::npos) << outcome.output;
  for (const fs::directory_entry& entry : fs::directory_iterator(release.path()))
    EXPECT_EQ(entry.path().filename().string().find("b."), std::string::npos)
        << entry.path() << " was left behind";
}

}  // namespace
}  // namespace swarmcert::tests

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

#include "robustness/inputs.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

const std::string kCertify = "swarmcert certify phi.safetensors --nodes 0 -q ";
const std::string kSimulate =
    "swarmcert simulate hover --duration 0.5 --model model.toml --gains gains.toml -q ";

class Unwritable : public testing::Test {
 protected:
  void SetUp() override { make_inputs(folder_.path()); }
  Outcome run(const std::string& command) const { return run_shell(command, folder_.path()); }

  void expect_refusal(const std::string& command, const std::string& words) const {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 3) << command << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find(words), std::string::npos) << command << "\n" << outcome.output;
  }

  bool has_temporary_files() const {
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      if (entry.path().string().find(".part-") != std::string::npos) return true;
    }
    return false;
  }

  ScratchFolder folder_;
};

TEST_F(Unwritable, FullStandardOutputIsAnError) {
  expect_refusal(kCertify + "> /dev/full", "No space left on device");
  expect_refusal(kCertify + "--json - > /dev/full",
                 "standard output: cannot be written (No space left on device)");
  expect_refusal("swarmcert --bash-completion > /dev/full", "No space left on device");
  EXPECT_EQ(run(kCertify + "--json /dev/full").exit_code, 3);
  EXPECT_EQ(run(kCertify + "--json /dev/null").exit_code, 0) << "devices need no --force";
}

TEST_F(Unwritable, ClosedStandardOutputReachesNoFile) {
  ASSERT_EQ(run(kCertify + "-o open.json").exit_code, 0);
  ASSERT_EQ(run(kCertify + "-o closed.json >&- 2>&- <&-").exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "open.json"), read_text(folder_ / "closed.json"));
}

TEST_F(Unwritable, LimitOnTheSizeOfFilesIsAnError) {
  expect_refusal("ulimit -f 1; " + kCertify + "-o big.json >/dev/null",
                 "big.json: cannot be written (File too large)");
  expect_refusal("ulimit -f 1; " + kSimulate + "-o big", "big/cf1_00: cannot be written (File too large)");
  EXPECT_FALSE(fs::exists(folder_ / "big.json"));
  EXPECT_FALSE(has_temporary_files());
}

TEST_F(Unwritable, FoldersWithoutPermissionAreNamed) {
  fs::create_directory(folder_.path() / "locked");
  fs::permissions(folder_.path() / "locked", fs::perms::owner_read | fs::perms::owner_exec |
                                                 fs::perms::others_read | fs::perms::others_exec);
  // Permissions do not restrict root.
  std::string as_user;
  if (geteuid() == 0) {
    as_user = "setpriv --reuid=65534 --regid=65534 --clear-groups ";
    if (run(as_user + "swarmcert --version").exit_code != 0)
      GTEST_SKIP() << "another user cannot run the tool here";
    run("chmod -R a+rX .");
  }
  for (const std::string command :
       {"certify phi.safetensors --nodes 0 -o locked/x",
        "certify phi.safetensors --nodes 0 --report locked/x",
        "simulate hover --duration 0.5 --model model.toml --gains gains.toml -o locked/x",
        "sweep grid.toml -o locked/x", "export network.toml -o locked/x",
        "inspect flights/1/cf1_00 --csv locked/x", "demo -o locked/x",
        "train model.toml flights --epochs 1 -o locked/x", "compare model.toml flights --report locked/x",
        "add drag_linear --keep-anyway --model model.toml flights -o locked/x",
        "bound --gains gains.toml --model model.toml --amplitude 0.1 --json locked/x"})
    expect_refusal(as_user + "swarmcert " + command + " -q >/dev/null", "locked/x");
}

TEST_F(Unwritable, TwoRunsInOneFolderLeaveWholeFilesOfOne) {
  ASSERT_EQ(run(kSimulate + "--seed 1 -o one && " + kSimulate + "--seed 2 -o two").exit_code, 0);
  const std::string one = read_text(folder_ / "one/cf1_00"), two = read_text(folder_ / "two/cf1_00");
  ASSERT_NE(one, two);
  for (int i = 0; i < 8; ++i) {
    ASSERT_EQ(run(kSimulate + "--seed 1 --force -o both >/dev/null & " + kSimulate +
                  "--seed 2 --force -o both >/dev/null; second=$?; wait $! && exit $second")
                  .exit_code,
              0);
    const std::string both = read_text(folder_ / "both/cf1_00");
    EXPECT_TRUE(both == one || both == two);
  }
  // Without --force the first file stays, and the second process is told so.
  int refused = 0;
  for (int i = 0; i < 8; ++i) {
    fs::remove(folder_ / "cert");
    const Outcome outcome = run(kCertify + "-o cert >/dev/null & " + kCertify +
                                "-o cert >/dev/null; echo second $?; "
                                "wait $!; echo first $?");
    const bool first = outcome.output.find("first 0") != std::string::npos;
    const bool second = outcome.output.find("second 0") != std::string::npos;
    EXPECT_NE(first, second) << outcome.output;
    refused += outcome.output.find("the file exists") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(refused, 8);
  EXPECT_FALSE(has_temporary_files());
}

}  // namespace
}  // namespace swarmcert::tests

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "robustness/inputs.h"

#ifdef SWARMCERT_FAULTS

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

using Contents = std::map<std::string, std::string>;  // by path below the folder

Contents contents_of(const fs::path& folder) {
  Contents contents;
  if (!fs::exists(folder)) return contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      contents[fs::relative(entry.path(), folder).string()] = read_text(entry.path().string());
  }
  return contents;
}

bool is_temporary(const std::string& path) { return path.find(".part-") != std::string::npos; }

/// A command that writes; all its output goes to out/.
struct Job {
  const char* name;
  const char* command;
  int stride;  ///< every stride-th call is interrupted
};

const Job kJobs[] = {
    {"certify",
     "certify phi.safetensors --nodes 0 -o out/cert.json --json out/result.json --report out/report", 3},
    {"simulate",
     "simulate hover --vehicles 2 --duration 0.5 --model model.toml --gains gains.toml -o out/flights --json "
     "out/result.json",
     1},
    {"export", "export network.toml -o out/firmware --json out/result.json", 3},
    {"inspect", "inspect flights/1/cf1_00 --csv out/log.csv --json out/result.json", 1},
    {"sweep", "sweep grid.toml -o out/sweep --json out/result.json", 3},
    {"add",
     "add drag_linear --keep-anyway --model model.toml flights -o out/fitted.toml --json out/result.json", 1},
    {"gate_slow",
     "gate policy.toml --baseline baseline.json --bundle out/bundle --junit out/gate.xml --sarif "
     "out/gate.sarif --markdown out/gate.md --report out/report --json out/result.json",
     4},
    {"train_slow",
     "train model.toml flights --phi 4 --rho 4 --features 4 --epochs 2 -o out/trained --json out/result.json",
     5},
};

class InterruptedWrite : public testing::TestWithParam<Job> {
 protected:
  void SetUp() override {
    make_inputs(folder_.path());
    // Plots are not tested here.
    fs::create_directory(folder_.path() / "fake");
    write_text(folder_ / "fake/gnuplot", "#!/bin/sh\nexit 1\n");
    fs::permissions(folder_.path() / "fake/gnuplot", fs::perms::owner_all);
    fs::create_directory(out());
    const Outcome whole = run(0, "kill");
    ASSERT_EQ(whole.exit_code, 0) << whole.output;
    written_ = contents_of(out());
    ASSERT_FALSE(written_.empty());
    reset();  // existing folders are not created again
    ASSERT_EQ(run(0, "kill").exit_code, 0);
    calls_ = static_cast<int>(std::count(log_.begin(), log_.end(), '\n'));
  }

  fs::path out() const { return folder_.path() / "out"; }

  /// Places old files where the command writes.
  void reset() const {
    fs::remove_all(out());
    for (const auto& [path, content] : written_) {
      fs::create_directories((out() / path).parent_path());
      write_text((out() / path).string(), "old");
    }
  }

  /// Runs with a fault at call `at`; 0: no fault.
  Outcome run(int at, const std::string& kind) {
    fs::remove(folder_.path() / "log");
    const Outcome outcome = run_shell(
        fmt::format(
            "PATH=$PWD/fake:$PATH LD_PRELOAD={} FAULT_LOG=$PWD/log FAULT_AT={} FAULT_KIND={} swarmcert {} -q "
            "--force",
            SWARMCERT_FAULTS, at, kind, GetParam().command),
        folder_.path());
    log_ = read_text(folder_ / "log");
    return outcome;
  }

  /// Expects each file to be the complete old or the complete new one.
  /// @returns the number of temporary files left
  int expect_whole_files() const {
    int left = 0;
    for (const auto& [path, content] : contents_of(out())) {
      if (is_temporary(path)) {
        ++left;
      } else if (written_.count(path) == 0) {
        EXPECT_EQ(path, "trained/checkpoint.json") << "appeared";
        EXPECT_EQ(content.substr(content.size() - 2), "}\n");
      } else {
        EXPECT_TRUE(content == "old" || content == written_.at(path)) << path << " is neither old nor new";
      }
    }
    return left;
  }

  ScratchFolder folder_;
  Contents written_;
  std::string log_;
  int calls_ = 0;
};

TEST_P(InterruptedWrite, KillLeavesOldOrNewFilesAndTheNextRunRecovers) {
  int killed = 0, inside_a_write = 0, left = 0;
  for (int at = 1; at <= calls_; at += GetParam().stride) {
    SCOPED_TRACE(at);
    reset();
    const Outcome outcome = run(at, "kill");
    ASSERT_EQ(outcome.exit_code, 128 + SIGKILL) << outcome.output;
    ++killed;
    const std::size_t last = log_.rfind('\n', log_.size() - 2);
    if (log_.compare(last + 1, 5, "write") == 0) ++inside_a_write;
    left += expect_whole_files() > 0 ? 1 : 0;
  }
  ASSERT_EQ(run(0, "kill").exit_code, 0);
  for (const auto& [path, content] : contents_of(out())) {
    if (!is_temporary(path)) {
      EXPECT_EQ(content, written_[path]) << path;
    }
  }
  fmt::print("{}: {} of {} calls killed, {} in the middle of a write, {} left a temporary file\n",
             GetParam().name, killed, calls_, inside_a_write, left);
  EXPECT_GT(inside_a_write, 0) << "the sweep never hit what it is for";
}

TEST_P(InterruptedWrite, DiskErrorsAreNamedAndLeaveNothingHalf) {
  int failed = 0;
  for (const int error : {ENOSPC, EIO, EROFS}) {
    for (int at = 1 + error % 2; at <= calls_; at += 2 * GetParam().stride) {
      SCOPED_TRACE(fmt::format("{} at {}", std::strerror(error), at));
      reset();
      const Outcome outcome = run(at, std::to_string(error));
      EXPECT_EQ(expect_whole_files(), 0) << "a temporary file is left";
      EXPECT_EQ(outcome.exit_code, 3) << outcome.output;
      EXPECT_NE(outcome.output.find(std::strerror(error)), std::string::npos) << outcome.output;
      EXPECT_NE(outcome.output.find("out/"), std::string::npos) << "names no file: " << outcome.output;
      ++failed;
    }
  }
  fmt::print("{}: {} failing calls\n", GetParam().name, failed);
  EXPECT_GT(failed, 0);
}

std::string name_of(const testing::TestParamInfo<Job>& job) { return job.param.name; }

INSTANTIATE_TEST_SUITE_P(Command, InterruptedWrite, testing::ValuesIn(kJobs), name_of);

}  // namespace
}  // namespace swarmcert::tests

#endif

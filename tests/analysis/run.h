/// @file Runs the built command line as a user would.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>
#ifdef SWARMCERT_CHECKS_SCHEMAS
#include "schemas/schema_check.h"
#endif

namespace swarmcert::tests {

struct Outcome {
  int exit_code = -1;
  std::string output;  ///< standard output and standard error, as a terminal shows them
};

/// Runs `command` in a shell in `folder`, with the built tool first in PATH. Results that it prints, or writes into a
/// temporary folder, must conform to their schemas.
inline Outcome run_shell(const std::string& command, const std::filesystem::path& folder) {
  const std::string tool_folder = std::filesystem::path(SWARMCERT_TOOL).parent_path().string();
  const std::string line =
      "cd '" + folder.string() + "' && PATH='" + tool_folder + "':$PATH && { " + command + "\n} 2>&1";
  Outcome outcome;
  [[maybe_unused]] const auto start = std::filesystem::file_time_type::clock::now();
  FILE* pipe = popen(line.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> buffer{};
  while (std::fgets(buffer.data(), static_cast<int>(buffer.size()), pipe) != nullptr)
    outcome.output += buffer.data();
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
#ifdef SWARMCERT_CHECKS_SCHEMAS
  expect_schema(outcome.output, command);
  const std::string temporary = std::filesystem::temp_directory_path().string();
  if (std::filesystem::absolute(folder).string().rfind(temporary, 0) == 0)
    expect_schemas_of_files(folder, start);
#endif
  return outcome;
}

/// A folder of the running test, empty at its start and removed at its end.
class ScratchFolder {
 public:
  ScratchFolder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() / ("swarmcert-" + std::string(test->test_suite_name()) +
                                                      "-" + test->name() + "-" + std::to_string(getpid()));
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// Base of tests that run `swarmcert` in a folder of their own.
class CommandLineTest : public testing::Test {
 protected:
  Outcome run(const std::string& arguments) { return run_shell("swarmcert " + arguments, folder_.path()); }

  /// Expects that `arguments` ends with `exit_code` and that the output contains each of `words`.
  void expect(const std::string& arguments, int exit_code, const std::vector<std::string>& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << "swarmcert " << arguments << "\n" << outcome.output;
    for (const std::string& word : words) {
      EXPECT_NE(outcome.output.find(word), std::string::npos) << "no \"" << word << "\" in\n"
                                                              << outcome.output;
    }
  }

  ScratchFolder folder_;
};

inline void write_text(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

inline std::string read_text(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace swarmcert::tests

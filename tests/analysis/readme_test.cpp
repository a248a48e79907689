#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "analysis/run.h"
#include "data.h"

namespace swarmcert {
namespace {

/// One command of a ```console block and the output shown below it. "..." at the start of a line skips lines.
struct Example {
  std::string command;
  std::vector<std::string> output;
};

std::vector<Example> examples(const std::string& markdown) {
  std::vector<Example> found;
  std::istringstream text(markdown);
  bool inside = false;
  for (std::string line; std::getline(text, line);) {
    if (line.rfind("```", 0) == 0) {
      inside = line == "```console";
    } else if (inside && line.rfind("$ ", 0) == 0) {
      found.push_back({line.substr(2), {}});
    } else if (inside && !found.empty()) {
      found.back().output.push_back(line);
    }
  }
  return found;
}

/// Words of a line; numbers agree if they are equal to seven digits: the last ones may depend on the processor.
bool same(const std::string& shown, const std::string& printed) {
  std::istringstream a(shown);
  std::istringstream b(printed);
  std::string x;
  std::string y;
  while (true) {
    const bool more_a = static_cast<bool>(a >> x);
    const bool more_b = static_cast<bool>(b >> y);
    if (!more_a || !more_b) return more_a == more_b;
    char* end_x = nullptr;
    char* end_y = nullptr;
    const double number_x = std::strtod(x.c_str(), &end_x);
    const double number_y = std::strtod(y.c_str(), &end_y);
    const bool numbers = *end_x == '\0' && *end_y == '\0';
    if (numbers ? std::abs(number_x - number_y) > 1e-7 * std::abs(number_x) : x != y) return false;
  }
}

bool appears(const std::string& shown, const std::vector<std::string>& printed, std::size_t& from) {
  for (; from < printed.size(); ++from) {
    if (same(shown, printed[from])) {
      ++from;
      return true;
    }
  }
  return false;
}

TEST(Readme, EveryCommandWorksAndPrintsWhatIsShown) {
  const tests::ScratchFolder folder;
  for (const std::string name : {"analysis", "controller", "nn", "stability"})
    std::filesystem::create_directory_symlink(tests::source_path(name), folder.path() / name);
  int commands = 0;
  for (const Example& example : examples(tests::read_text(tests::source_path("README.md")))) {
    if (example.command.rfind("./bootstrap", 0) ==
        0) {  // what runs this test; its words are checked, not run again
      const tests::Outcome help = tests::run_shell("./bootstrap --help", SWARMCERT_SOURCE_DIR);
      EXPECT_EQ(help.exit_code, 0) << help.output;
      std::istringstream words(example.command);
      std::string verb;
      words >> verb >> verb;
      EXPECT_NE(help.output.find(verb), std::string::npos) << example.command;
      ++commands;
      continue;
    }
    const tests::Outcome outcome =
        tests::run_shell(example.command + "; echo \"exit code $?\"", folder.path());
    std::vector<std::string> printed;
    std::istringstream lines(outcome.output);
    for (std::string line; std::getline(lines, line);) printed.push_back(line);
    ASSERT_FALSE(printed.empty());
    const bool states_code = !example.output.empty() && example.output.back().rfind("exit code", 0) == 0;
    if (!states_code) {
      EXPECT_EQ(printed.back(), "exit code 0") << example.command << "\n" << outcome.output;
    }
    std::size_t from = 0;
    for (const std::string& line : example.output) {
      if (line.empty() || line.rfind("...", 0) == 0) continue;
      EXPECT_TRUE(appears(line, printed, from))
          << example.command << " did not print\n  " << line << "\nbut\n"
          << outcome.output;
    }
    ++commands;
  }
  EXPECT_GE(commands, 20) << "the README lost its examples";
}

}  // namespace
}  // namespace swarmcert

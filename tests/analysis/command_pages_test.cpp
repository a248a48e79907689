#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "analysis/cli/command.h"
#include "analysis/commands/commands.h"
#include "analysis/run.h"

namespace swarmcert::analysis {
namespace {

using tests::Outcome;
using tests::ScratchFolder;

const char* const kManualPages = SWARMCERT_MANUAL_PAGES;

class CommandPages : public testing::Test {
 protected:
  std::string text_of(const std::string& arguments) const {
    const Outcome outcome = tests::run_shell(arguments, folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.output;
    return outcome.output;
  }

  /// The options listed by --help, as printed by the parser's own formatter and therefore independent of the pages.
  std::set<std::string> options_of(const std::string& command) const {
    std::set<std::string> options;
    std::istringstream lines(text_of("swarmcert " + command + " --help"));
    static const std::regex kOption("--?[a-z][a-z0-9-]*");
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("  -", 0) != 0) continue;
      const std::string names = line.substr(2, line.find(' ', 2) - 2);
      for (std::sregex_iterator at(names.begin(), names.end(), kOption), end; at != end; ++at)
        options.insert(at->str());
    }
    return options;
  }

  ScratchFolder folder_;
};

/// The text from `start` to the next occurrence of `end`.
std::string section(const std::string& page, const std::string& start, const std::string& end) {
  const std::size_t from = page.find(start);
  if (from == std::string::npos) return "";
  return page.substr(from, page.find(end, from + start.size()) - from);
}

TEST_F(CommandPages, EveryOptionOfEveryCommandIsCompletedAndInItsManualPage) {
  const bool has_pages = std::filesystem::exists(kManualPages);
  const std::string completion = text_of("swarmcert --bash-completion");
  int options = 0;
  for (const Command& command : commands()) {
    SCOPED_TRACE(command.name);
    const std::string manual =
        has_pages ? text_of("gzip -dc " SWARMCERT_MANUAL_PAGES "/swarmcert-" + command.name + ".1.gz") : "";
    const std::string in_completion = section(completion, "\n    " + command.name + ") options='", "\n");
    for (const std::string& option : options_of(command.name)) {
      ++options;
      const std::string in_roff = std::regex_replace(option, std::regex("-"), "\\-");
      EXPECT_TRUE(!has_pages || manual.find(in_roff) != std::string::npos) << option;
      EXPECT_TRUE(std::regex_search(in_completion, std::regex("[' ]" + option + "[' ]"))) << option;
    }
  }
  EXPECT_GT(options,
            7 * static_cast<int>(commands().size()));  // -h --help --json -j --jobs --force -q --quiet
}

TEST_F(CommandPages, ManualPagesHaveTheVersionAndNoWarnings) {
  if (!std::filesystem::exists(kManualPages)) GTEST_SKIP() << "help2man is not installed";
  const bool has_man = tests::run_shell("command -v man", folder_.path()).exit_code == 0;
  std::size_t pages = 0;
  for (const auto& page : std::filesystem::directory_iterator(kManualPages)) {
    SCOPED_TRACE(page.path().string());
    ++pages;
    EXPECT_NE(text_of("gzip -dc " + page.path().string()).find(SWARMCERT_VERSION "\""), std::string::npos);
    // -Wbreak: long names leave lines that cannot be filled.
    const std::string show = "MANROFFOPT=-Wbreak LC_ALL=C.UTF-8 man --warnings -l ";
    EXPECT_EQ(has_man ? text_of(show + page.path().string() + " 2>&1 >/dev/null") : "", "");
  }
  EXPECT_EQ(pages, commands().size() + 1);
}

TEST_F(CommandPages, TabCompletesInAnInteractiveBash) {
  text_of("swarmcert --bash-completion > completion && bash -n completion");
  tests::write_text(folder_ / "weights.pth", "");
  // The shell reads keys from a terminal and runs a function in place of the tool.
  tests::write_text(folder_ / "keys",
                    "PS1=; source ./completion; swarmcert() { printf 'words:%s\\n' \"$*\"; }\n"
                    "swarmcert certi\t weig\t --meth\tbr\t --gamma 3\n"
                    "swarmcert certify --method=pr\t\n"
                    "swarmcert simu\tsw\t --veh\t2\n"
                    "exit\n");
  const std::string output = text_of("TERM=dumb script -qec 'bash --norc --noprofile -i' /dev/null < keys");
  EXPECT_NE(output.find("\nwords:certify weights.pth --method branch --gamma 3\r"), std::string::npos)
      << output;
  EXPECT_NE(output.find("\nwords:certify --method=product\r"), std::string::npos) << output;
  EXPECT_NE(output.find("\nwords:simulate swap --vehicles 2\r"), std::string::npos) << output;
}

TEST_F(CommandPages, VersionOfToolResultsAndChangeLogIsOne) {
  EXPECT_EQ(text_of("swarmcert --version"), "swarmcert " SWARMCERT_VERSION "\n");
  const std::string changes = tests::read_text(SWARMCERT_SOURCE_DIR "/CHANGELOG.md");
  const std::size_t newest = changes.find("\n## ");
  ASSERT_NE(newest, std::string::npos);
  EXPECT_EQ(changes.compare(newest, 4 + sizeof SWARMCERT_VERSION, "\n## " SWARMCERT_VERSION ","), 0);
  const std::string result =
      text_of("swarmcert inspect " SWARMCERT_SOURCE_DIR "/nn/networks/demo/phi.safetensors --json -");
  EXPECT_NE(result.find("\"tool\": \"swarmcert " SWARMCERT_VERSION "\""), std::string::npos) << result;
}

}  // namespace
}  // namespace swarmcert::analysis

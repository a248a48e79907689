/// The README and the guides as readers of their commands use them: a clone, every block pasted in order, and the
/// numbers shown.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "analysis/run.h"
#include "data.h"

namespace swarmcert::tests {
namespace {

/// One command of a ```console block and the output shown below it. "..." at the start of a line skips lines.
struct Example {
  std::string command;  ///< including continuation lines after a backslash
  std::vector<std::string> output;
};

using Block = std::vector<Example>;

std::vector<Block> blocks_of(const std::string& markdown) {
  std::vector<Block> blocks;
  std::istringstream text(markdown);
  bool inside = false, continues = false;
  for (std::string line; std::getline(text, line);) {
    if (line.rfind("```", 0) == 0) {
      inside = line == "```console";
      if (inside) blocks.emplace_back();
      continue;
    }
    if (!inside) continue;
    Block& block = blocks.back();
    if (continues)
      block.back().command += "\n" + line;
    else if (line.rfind("$ ", 0) == 0)
      block.push_back({line.substr(2), {}});
    else if (!block.empty())
      block.back().output.push_back(line);
    const bool is_command = continues || line.rfind("$ ", 0) == 0;
    continues = is_command && !line.empty() && line.back() == '\\';
  }
  return blocks;
}

/// Returns a page of commands: of a guide in C++ the text of its comments.
std::string page_text(const std::string& path) {
  const std::string text = read_text(path);
  if (path.substr(path.size() - 4) != ".cpp") return text;
  std::istringstream source(text);
  std::string page;
  for (std::string line; std::getline(source, line);) {
    const std::size_t start = line.find("//");
    if (start != std::string::npos && line.find_first_not_of(' ') == start)
      page += line.substr(std::min(start + 3, line.size())) + "\n";
  }
  return page;
}

/// Returns why a command is not run; empty if it is run.
std::string excluded(const std::string& command) {
  const std::pair<const char*, const char*> kExcluded[] = {
      {"./bootstrap", "it installs packages and builds the tree that runs this test"},
      {"git clone", "the blocks run in a clone already"},
      {"sudo ", "it changes the machine"}};
  for (const auto& [start, why] : kExcluded) {
    if (command.rfind(start, 0) == 0) return why;
  }
  return "";
}

/// Whether text and numbers agree; numbers to seven digits, because further digits may depend on the processor.
bool same(const std::string& shown, const std::string& printed) {
  const char *a = shown.c_str(), *b = printed.c_str();
  const auto skip_blanks = [](const char*& at) {
    const char* const start = at;
    while (*at == ' ' || *at == '\t' || *at == '\r') ++at;
    return at != start;
  };
  skip_blanks(a);
  skip_blanks(b);
  while (*a != '\0' && *b != '\0') {
    const bool blank_a = skip_blanks(a), blank_b = skip_blanks(b);
    if (*a == '\0' || *b == '\0') break;
    if (blank_a != blank_b) return false;
    const bool is_number = (*a >= '0' && *a <= '9') && (*b >= '0' && *b <= '9');
    if (!is_number) {
      if (*a++ != *b++) return false;
      continue;
    }
    char *end_a = nullptr, *end_b = nullptr;
    const double x = std::strtod(a, &end_a), y = std::strtod(b, &end_b);
    if (!(std::abs(x - y) <= 1e-7 * std::abs(x))) return false;
    a = end_a;
    b = end_b;
  }
  skip_blanks(a);
  skip_blanks(b);
  return *a == '\0' && *b == '\0';
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

/// The output of a command by line, and its exit code.
struct Printed {
  std::vector<std::string> lines;
  int exit_code = -1;
};

constexpr const char* kEnd = "@@ exit code ";

/// Runs the block in a single shell, as if it were pasted. LOGS is the folder of recorded logs.
std::vector<Printed> run_block(const Block& block, const std::string& script,
                               const std::filesystem::path& folder) {
  std::string text = "export LOGS='" + std::filesystem::absolute(data_path("")).string() + "'\n";
  for (const Example& example : block) {
    const bool runs = excluded(example.command).empty();
    text += (runs ? example.command : ":") + "\nprintf '\\n" + kEnd + "%d\\n' $?\n";
  }
  write_text(script, text);
  const Outcome outcome = run_shell("bash '" + script + "'", folder);
  std::vector<Printed> printed(1);
  std::istringstream lines(outcome.output);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(kEnd, 0) != 0) {
      printed.back().lines.push_back(line);
      continue;
    }
    printed.back().exit_code = std::atoi(line.c_str() + std::string(kEnd).size());
    printed.emplace_back();
  }
  printed.pop_back();
  return printed;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

/// Checks an example and counts the compared lines.
void check(const Example& example, const Printed& printed, int& compared) {
  const bool states_code = !example.output.empty() && example.output.back().rfind("exit code ", 0) == 0;
  const int expected = states_code ? std::atoi(example.output.back().c_str() + 10) : 0;
  EXPECT_EQ(printed.exit_code, expected) << example.command << "\n" << joined(printed.lines);
  std::size_t from = 0;
  for (std::size_t i = 0; i + (states_code ? 1 : 0) < example.output.size(); ++i) {
    const std::string& line = example.output[i];
    if (line.empty() || line.rfind("...", 0) == 0) continue;
    EXPECT_TRUE(appears(line, printed.lines, from))
        << example.command << " did not print\n  " << line << "\nbut\n"
        << joined(printed.lines);
    ++compared;
  }
}

/// Checks the arguments of a bootstrap command, which is not run.
void check_bootstrap(const std::string& command, const std::filesystem::path& clone) {
  std::istringstream words(command);
  std::string verb;
  words >> verb >> verb;
  const Outcome help = run_shell("./bootstrap --help", clone);
  EXPECT_EQ(help.exit_code, 0) << help.output;
  EXPECT_NE(help.output.find(verb), std::string::npos) << command;
}

TEST(Readme, LinesAgreeOnlyIfTheirNumbersDo) {
  EXPECT_TRUE(same("  ball: 0.137868 m", "  ball:   0.137868 m"));
  EXPECT_TRUE(same("(56.5 %, 90 %: 52.1)", "(56.5 %, 90 %: 52.1)"));
  EXPECT_TRUE(same("upper 476.6906052", "upper 476.69060521"));
  EXPECT_FALSE(same("upper 476.6906", "upper 476.6916"));
  EXPECT_FALSE(same("(56.5 %, 90 %: 52.1)", "(56.5 %, 90 %: 52.2)"));
  EXPECT_FALSE(same("verdict: proved", "verdict: proved, but"));
  EXPECT_FALSE(same("verdict: proved", "verdict:"));
}

TEST(Readme, BlocksKeepTheirCommandsInOrderWithContinuationsAndOutput) {
  const std::vector<Block> blocks = blocks_of(
      "```console\n$ one \\\n    two\nout\n$ three\n```\ntext\n```toml\n$ no\n```\n```console\n$ "
      "four\n```\n");
  ASSERT_EQ(blocks.size(), 2u);
  ASSERT_EQ(blocks[0].size(), 2u);
  EXPECT_EQ(blocks[0][0].command, "one \\\n    two");
  EXPECT_EQ(blocks[0][0].output, (std::vector<std::string>{"out"}));
  EXPECT_EQ(blocks[1][0].command, "four");
}

/// A page with commands, and the least number of commands and of compared lines that it must keep.
struct CommandPage {
  const char *name, *path;
  int commands, compared;
};

class PageOfCommands : public testing::TestWithParam<CommandPage> {};

/// Uses a clone of HEAD: uncommitted files are missing, and files committed by accident are present. The page is read
/// from the clone as well.
TEST_P(PageOfCommands, WorksInAFreshCloneAndPrintsWhatIsShown) {
  const std::string cross = "command -v arm-none-eabi-g++ qemu-system-arm";
  const ScratchFolder folder;
  const std::string page = page_text(source_path(GetParam().path));
  if (page.find("$LOGS") != std::string::npos) SWARMCERT_NEEDS_DATA();
  if (page.find("arm-none-eabi-g++ ") != std::string::npos && run_shell(cross, folder.path()).exit_code != 0)
    GTEST_SKIP() << "an image is built for the Cortex-M4 and run: " << cross;
  write_text(folder / "gitconfig", "[safe]\n\tdirectory = *\n");  // the checkout may belong to another user
  const Outcome cloned = run_shell(
      "GIT_CONFIG_GLOBAL='" + folder / "gitconfig" + "' git clone --quiet '" + source_path("") + "' clone",
      folder.path());
  if (!std::filesystem::exists(source_path(".git"))) GTEST_SKIP() << "the sources are no git repository";
  ASSERT_EQ(cloned.exit_code, 0) << cloned.output;
  const std::filesystem::path clone = folder.path() / "clone";
  int number = 0, commands = 0, compared = 0;
  for (const Block& block : blocks_of(page_text((clone / GetParam().path).string()))) {
    const std::vector<Printed> printed =
        run_block(block, folder / ("block_" + std::to_string(++number) + ".sh"), clone);
    ASSERT_EQ(printed.size(), block.size()) << "the shell ended within block " << number;
    for (std::size_t i = 0; i < block.size(); ++i) {
      ++commands;
      if (excluded(block[i].command).empty())
        check(block[i], printed[i], compared);
      else if (block[i].command.rfind("./bootstrap", 0) == 0)
        check_bootstrap(block[i].command, clone);
    }
  }
  EXPECT_GE(commands, GetParam().commands) << "the page lost its examples";
  EXPECT_GE(compared, GetParam().compared) << "the page shows no output";
}

INSTANTIATE_TEST_SUITE_P(
    Readme, PageOfCommands,
    testing::Values(CommandPage{"Front", "README.md", 15, 10},
                    CommandPage{"FromYourLog", "notebooks_cpp/from_your_log.md", 15, 10},
                    CommandPage{"RecordedLogs", "notebooks_cpp/recorded_logs.md", 15, 12},
                    CommandPage{"Certify", "notebooks_cpp/01_certify_a_file.cpp", 2, 3},
                    CommandPage{"Bounds", "notebooks_cpp/02_bounds_and_gains.cpp", 2, 3},
                    CommandPage{"Gate", "notebooks_cpp/03_gate_a_release.cpp", 4, 2},
                    CommandPage{"Compare", "notebooks_cpp/04_compare_with_a_flight.cpp", 2, 3},
                    CommandPage{"Diagnose", "notebooks_cpp/05_find_the_missing_effect.cpp", 2, 3},
                    CommandPage{"Add", "notebooks_cpp/06_add_it_and_watch_the_error_fall.cpp", 3, 3},
                    CommandPage{"Train", "notebooks_cpp/07_train_and_trade_error_against_the_bound.cpp", 2,
                                2},
                    CommandPage{"OwnEffect", "notebooks_cpp/08_write_your_own_effect.cpp", 3, 2}),
    [](const testing::TestParamInfo<CommandPage>& page) { return page.param.name; });

}  // namespace
}  // namespace swarmcert::tests

/// Reports: user-supplied text stays text in HTML, JSON, SVG, gnuplot and the shell.
#include "analysis/report/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "analysis/cli/command_line.h"
#include "analysis/report/report_text.h"
#include "analysis/run.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {
namespace {

using tests::read_text;
using tests::run_shell;
using tests::ScratchFolder;

/// Returns a string of pieces with a meaning in one of the languages of a report.
std::string hostile(std::mt19937& generator) {
  static const std::vector<std::string> kPieces = {"<script>",
                                                   "</script>",
                                                   "<!--",
                                                   "-->",
                                                   "<img src=x onerror=a()>",
                                                   "\"",
                                                   "'",
                                                   "`touch pwned`",
                                                   "$(touch pwned)",
                                                   "\n",
                                                   "\r\n",
                                                   "\\",
                                                   "\\n",
                                                   "\\074",
                                                   "&",
                                                   "&lt;",
                                                   "&#x3c;",
                                                   "]]>",
                                                   "' ; system 'touch pwned' ; '",
                                                   "#",
                                                   "{/Symbol a}",
                                                   "@pwned",
                                                   "\xff\xfe",
                                                   "\x01",
                                                   std::string(1, '\0'),
                                                   "e\ne\nplot sin(x)",
                                                   "--",
                                                   "/* */",
                                                   "{{",
                                                   "javascript:",
                                                   "\xE2\x80\xA8",
                                                   "\x7f",
                                                   "a",
                                                   " ",
                                                   "%s"};
  std::string text;
  for (unsigned long n = 1 + generator() % 6; n > 0; --n) text += kPieces[generator() % kPieces.size()];
  return text;
}

constexpr int kTexts = 25;

Report report_with(const std::vector<std::string>& text) {
  Report report(text[0]);
  report.result({{"schema", "swarmcert/test/1"}, {"name", text[1]}});
  report.heading(text[2]);
  report.paragraph(text[3]);
  report.facts({{text[4], text[5]}});
  report.literal(text[6]);
  report.table({text[4], "n"}, {{text[5], text[6]}});
  report.figure(
      "curve", "1 2 " + plot_field(text[7]) + "\n2 3 " + plot_field(text[8]) + "\n",
      "set xlabel " + plot_string(text[9]) + "\nplot 'curve.dat' using 1:2:xtic(3) with lines title 't'\n",
      text[10]);
  report.bars("bars", {{text[11], 1, 0.5, 2}, {text[12], 2, NAN, NAN}}, text[13], text[14]);
  Flown flown;
  flown.groups = {{"position", text[15], {"x", "y", "z"}}};
  flown.logs = {{text[18], text[19], {{0, 1}, {1, 2}, {2, 2}, {NAN, 4}}}};
  flown.marks = {{text[18], text[19], 1, 1, 2}};
  flown.force_unit = text[20];
  report.flown(flown, text[16], text[21]);
  report.moments({{text[22], text[23], 1, 2, text[24]}});
  return report;
}

/// Returns the names of the page's tags in order, without the content of scripts. User-supplied text must not change
/// them.
std::string skeleton(const std::string& html) {
  std::string result, inside;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    const std::size_t end = html.find_first_of(" >\n", at);
    const std::string name = html.substr(at + 1, end - at - 1);
    if (!inside.empty() && name != "/" + inside) continue;
    inside = name == "script" || name == "style" ? name : "";
    result += name + " ";
  }
  return result;
}

std::string element(const std::string& html, const std::string& id) {
  const std::size_t begin = html.find('>', html.find("id=\"" + id + "\"")) + 1;
  return html.substr(begin, html.find("</script>", begin) - begin);
}

bool has_gnuplot() { return run_shell("gnuplot --version", "/").exit_code == 0; }

TEST(Report, HostileTextStaysTextAndRunsNothing) {
  const ScratchFolder folder;
  const std::string plain_page =
      read_text(report_with(std::vector<std::string>(kTexts, "plain")).write(folder / "plain", false));
  std::mt19937 generator(31);
  for (int i = 0; i < 12; ++i) {
    std::vector<std::string> text;
    for (int k = 0; k < kTexts; ++k) text.push_back(hostile(generator));
    const std::string page =
        read_text(report_with(text).write(folder / ("fuzzed" + std::to_string(i)), false));
    EXPECT_EQ(skeleton(page), skeleton(plain_page)) << i;
    EXPECT_EQ(files::parse_json(element(page, "result"), "result")["name"],
              files::parse_json(files::to_text({{"name", text[1]}}), "text")["name"]);
    EXPECT_EQ(page.find("Not drawn"), has_gnuplot() ? std::string::npos : page.find("Not drawn"));
    for (const char* svg : {"/curve.svg", "/bars.svg"}) {
      const std::string path = folder / ("fuzzed" + std::to_string(i) + svg);
      EXPECT_EQ(read_text(path).find("<script"), std::string::npos) << path;
    }
  }
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder.path()))
    EXPECT_EQ(file.path().string().find("pwned"), std::string::npos) << file.path();
  EXPECT_FALSE(std::filesystem::exists("pwned"));
}

TEST(Report, FieldsOfDataFilesCannotEndEarly) {
  std::mt19937 generator(32);
  for (int i = 0; i < 2000; ++i) {
    const std::string field = plot_field(hostile(generator));
    ASSERT_GE(field.size(), 2u);
    const std::string inside = field.substr(1, field.size() - 2);
    EXPECT_EQ(field.front(), '"');
    EXPECT_EQ(field.back(), '"');
    EXPECT_LE(field.size(), 2u + 3 + 4 * 26);
    for (const char c : inside)
      EXPECT_TRUE(static_cast<unsigned char>(c) >= 0x20 && c != '"' && c != '\\') << inside;
  }
}

TEST(Report, CommandsAreReadBackByTheShellAsTheSameWords) {
  const ScratchFolder folder;
  std::mt19937 generator(33);
  for (int i = 0; i < 20; ++i) {
    std::vector<std::string> words = {"printf", "%s|"};
    std::string expected;
    for (int k = 0; k < 4; ++k) {
      std::string word = hostile(generator);
      word.erase(std::remove(word.begin(), word.end(), '\0'), word.end());
      words.push_back(word);
      expected += word + "|";
    }
    EXPECT_EQ(run_shell(shell_line(words), folder.path()).output, expected);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "pwned"));
}

/// Returns command_to_copy() after a command with the usual options has parsed `words`.
std::string copied(const std::vector<const char*>& words) {
  CLI::App command;
  std::string path;
  int jobs = 0;
  add_output(command, "-o,--output", path, "");
  add_output(command, "--report", path, "");
  leave_out_of_record(command.add_option("-j,--jobs", jobs, ""));
  leave_out_of_record(command.add_flag("-q,--quiet", ""));
  remember_command_line(static_cast<int>(words.size()), words.data(), command);
  return command_to_copy();
}

TEST(Report, CommandToCopyNamesOutputsButNotWhereTheyWent) {
  EXPECT_EQ(
      copied({"swarmcert", "add", "ground", "a b.toml", "-o", "x.toml", "--jobs", "2", "--report", "r"}),
      "swarmcert add ground 'a b.toml' -o OUTPUT --report REPORT");
  EXPECT_EQ(copied({"swarmcert", "bound", "--report=r", "-q"}), "swarmcert bound --report REPORT");
  EXPECT_EQ(copied({"swarmcert", "add", "-qj2", "-ox", "-qj", "3"}), "swarmcert add -o OUTPUT");
  EXPECT_EQ(copied({"swarmcert", "demo"}), "swarmcert demo");
}

TEST(Report, DrawingsAreImagesInWhichBrowsersRunNothing) {
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot";
  const ScratchFolder folder;
  const std::string page =
      read_text(report_with(std::vector<std::string>(kTexts, "plain")).write(folder / "r", false));
  EXPECT_EQ(skeleton(page).find("svg "), std::string::npos) << "a drawing is part of the page";
  int pictures = 0;
  for (const char* start :
       {"<img src=\"data:image/svg+xml;base64,", " srcset=\"data:image/svg+xml;base64,"}) {
    for (std::size_t at = page.find(start); at != std::string::npos; at = page.find(start, at + 1))
      ++pictures;
  }
  EXPECT_EQ(pictures, 4) << "the curve and the bars, wide and narrow";
}

TEST(Report, IsTheSameInAnotherFolderAndKeepsItsData) {
  const ScratchFolder folder;
  const std::vector<std::string> text(kTexts, "text");
  const std::string page = read_text(report_with(text).write(folder / "one", false));
  EXPECT_EQ(read_text(report_with(text).write(folder / "another place", false)), page);
  EXPECT_TRUE(std::filesystem::exists(folder / "one/curve.dat"));
  EXPECT_TRUE(std::filesystem::exists(folder / "one/curve.gp"));
  EXPECT_THROW(report_with(text).write(folder / "one", false), std::exception);
  report_with(text).write(folder / "one", true);
}

TEST(Report, SaysSoWithoutGnuplot) {
  const ScratchFolder folder;
  const std::string path = getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  const std::string page =
      read_text(report_with(std::vector<std::string>(kTexts, "text")).write(folder / "r", false));
  setenv("PATH", path.c_str(), 1);
  EXPECT_NE(page.find("Not drawn: gnuplot is missing or failed. The data are in curve.dat."),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "r/curve.dat"));
}

}  // namespace
}  // namespace swarmcert::analysis

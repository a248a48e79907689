#include "analysis/cli/command_line.h"

#include <set>

#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
namespace {

struct Remembered {
  std::vector<std::string> words;
  bool has_output = false, has_report = false;
};

Remembered& remembered() {
  static Remembered line;
  return line;
}

}  // namespace

void remember_command_line(int argc, const char* const* argv) {
  static const std::set<std::string> with_value = {
      "--jobs",   "-j",       "--json",  "-o",      "--output",   "--report", "--csv",
      "--fitted", "--inject", "--junit", "--sarif", "--markdown", "--bundle"};
  const auto note = [](const std::string& word) {
    if (word == "-o" || word == "--output") remembered().has_output = true;
    if (word == "--report") remembered().has_report = true;
  };
  // An interrupted run that went on has the result of an unbroken one.
  static const std::set<std::string> flags = {"-q", "--quiet", "--force", "--github", "--resume"};
  // "-j2", "-qj2", "-qj 2", "-ofile": one dash, then flags, then perhaps an option with its value.
  const auto short_options = [](const std::string& word) {
    if (word.size() < 3 || word[0] != '-' || word[1] == '-') return std::string::npos;
    std::size_t at = 1;
    while (at < word.size() && word[at] == 'q') ++at;
    return at == word.size() || word[at] == 'j' || word[at] == 'o' ? at : std::string::npos;
  };
  std::vector<std::string>& words = remembered().words;
  remembered().has_output = remembered().has_report = false;
  words = {"swarmcert"};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (flags.count(word) == 1) continue;
    if (with_value.count(word) == 1) {
      note(word);
      ++i;
      continue;
    }
    if (const std::size_t at = short_options(word); at != std::string::npos) {
      if (at < word.size() && word[at] == 'o') remembered().has_output = true;
      if (at + 1 == word.size()) ++i;  // its value is the next word
      continue;
    }
    const std::string before_equals = word.substr(0, word.find('='));
    if (before_equals != word && with_value.count(before_equals) == 1) {
      note(before_equals);
      continue;
    }
    words.push_back(word);
  }
}

const std::vector<std::string>& command_line() { return remembered().words; }

std::string command_to_copy() {
  std::vector<std::string> words = remembered().words;
  if (words.empty()) return "";
  if (remembered().has_output) words.insert(words.end(), {"-o", "OUTPUT"});
  if (remembered().has_report) words.insert(words.end(), {"--report", "REPORT"});
  return shell_line(words);
}

}  // namespace swarmcert::analysis

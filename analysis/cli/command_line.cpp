#include "analysis/cli/command_line.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "analysis/cli/command.h"
#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
namespace {

/// The type name that --help shows for outputs, and by which outputs are recognised.
constexpr const char* kOutput = "OUTPUT";

struct Remembered {
  std::vector<std::string> words;
  bool has_output = false, has_report = false;
};

Remembered& remembered() {
  thread_local Remembered line;  // a host may run several commands at once
  return line;
}

/// Names of the options that are not recorded, including their dashes.
struct Unrecorded {
  std::set<std::string> flags, with_value;

  explicit Unrecorded(const CLI::App& command) {
    for (const CLI::Option* option : command.get_options()) {
      if (option->get_configurable()) continue;
      std::set<std::string>& names = option->get_expected_max() == 0 ? flags : with_value;
      for (const std::string& name : option->get_lnames()) names.insert("--" + name);
      for (const std::string& name : option->get_snames()) names.insert("-" + name);
    }
  }

  /// Returns the position of the option with a value in a cluster such as "-j2", "-qj2" or "-qofile"; the
  /// size of `word` if the cluster contains only flags; npos if `word` is not a cluster of unrecorded options.
  std::size_t value_in_cluster(const std::string& word) const {
    if (word.size() < 3 || word[0] != '-' || word[1] == '-') return std::string::npos;
    std::size_t at = 1;
    while (at < word.size() && flags.count({'-', word[at]}) == 1) ++at;
    return at == word.size() || with_value.count({'-', word[at]}) == 1 ? at : std::string::npos;
  }
};

void note_output(const std::string& name) {
  if (name == "-o" || name == "--output") remembered().has_output = true;
  if (name == "--report") remembered().has_report = true;
}

}  // namespace

CLI::Option* add_output(CLI::App& app, const std::string& names, std::string& path,
                        const std::string& description) {
  return leave_out_of_record(app.add_option(names, path, description))->type_name(kOutput);
}

CLI::Option* leave_out_of_record(CLI::Option* option) { return option->configurable(false); }

void refuse_shared_output(const CLI::App& command) {
  std::map<std::string, std::string> written_by;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_type_name() != kOutput || option->count() == 0) continue;
    const std::string& path = option->results().back();
    const std::string name =
        option->get_snames().empty() ? "--" + option->get_lnames()[0] : "-" + option->get_snames()[0];
    const std::string target =
        path == "-" ? path : std::filesystem::weakly_canonical(std::filesystem::absolute(path)).string();
    const auto [other, is_new] = written_by.emplace(target, name);
    if (!is_new)
      throw UsageError(fmt::format("{} and {} both write {}: name two files", other->second, name, path));
  }
}

void remember_command_line(int argc, const char* const* argv, const CLI::App& command) {
  const Unrecorded unrecorded(command);
  remembered() = {};
  std::vector<std::string>& words = remembered().words;
  words = {"swarmcert"};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (unrecorded.flags.count(word) == 1) continue;
    if (unrecorded.with_value.count(word) == 1) {
      note_output(word);
      ++i;
      continue;
    }
    if (const std::size_t at = unrecorded.value_in_cluster(word); at != std::string::npos) {
      if (at < word.size()) note_output({'-', word[at]});
      if (at + 1 == word.size()) ++i;  // its value is the next word
      continue;
    }
    const std::string before_equals = word.substr(0, word.find('='));
    if (before_equals != word && unrecorded.with_value.count(before_equals) == 1) {
      note_output(before_equals);
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

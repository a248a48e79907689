#include "analysis/cli/command_pages.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <vector>

namespace swarmcert::analysis {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option*) { return true; });
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

/// What an option takes, as CLI11 words it: "TEXT:{auto,sdp}", "FLOAT:POSITIVE".
struct Value {
  std::string type;
  std::vector<std::string> choices;
  std::string condition;
};

Value value_of(const CLI::Option& option) {
  Value value;
  if (option.get_expected_max() == 0) return value;  // a flag
  const std::string text = option.get_type_name();
  const std::size_t colon = text.find(':');
  value.type = text.substr(0, colon);
  if (colon != std::string::npos) value.condition = text.substr(colon + 1);
  const std::size_t open = text.find('{'), close = text.rfind('}');
  if (open == std::string::npos || close == std::string::npos) return value;
  std::istringstream list(text.substr(open + 1, close - open - 1));
  for (std::string choice; std::getline(list, choice, ',');) value.choices.push_back(choice);
  value.condition.clear();
  return value;
}

// --- man(7) ---

/// Text that roff prints as it stands: a backslash or a control character at the start of a line would be commands.
std::string roff(const std::string& text) {
  std::string result;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) result += "\\&";
    at_start = c == '\n';
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
  }
  return result;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff(text) + "\\fR"; }

/// Lines may break behind each of them.
std::string italic_choices(std::vector<std::string> choices) {
  for (std::string& choice : choices) choice = roff(choice);
  return fmt::format("\\fI{}\\fR", fmt::join(choices, "|\\:"));
}

/// Prose is filled; examples and indented lines stay as they are.
std::string roff_paragraphs(const std::string& text, bool after_heading = false) {
  std::istringstream lines(text);
  std::string result;
  bool literal = false, paragraph = !after_heading;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) {
      paragraph = true;
      continue;
    }
    const bool is_literal = line[0] == ' ' || line.rfind("Example", 0) == 0;
    if (literal && (!is_literal || paragraph)) result += ".fi\n";
    if (paragraph) result += ".PP\n";
    if (is_literal && (!literal || paragraph)) result += ".nf\n";
    literal = is_literal;
    paragraph = false;
    result += roff(line) + "\n";
  }
  return literal ? result + ".fi\n" : result;
}

std::string roff_option(const CLI::Option& option) {
  const Value value = value_of(option);
  std::string head;
  for (const std::string& name : names_of(option)) head += (head.empty() ? "" : ", ") + bold(name);
  if (option.get_positional()) head = italic(option.get_name(true));
  if (!value.choices.empty())
    head += " " + italic_choices(value.choices);
  else if (!value.type.empty() && !option.get_positional())
    head += " " + italic(value.type);
  std::string body = option.get_description();
  if (!value.condition.empty()) body += " (" + value.condition + ")";
  if (!option.get_default_str().empty()) body += " [default: " + option.get_default_str() + "]";
  if (option.get_required()) body += " [required]";
  return ".TP\n" + head + "\n" + roff(body) + "\n";
}

std::string roff_command(const CLI::App& command) {
  std::string text = ".SS " + roff(command.get_name()) + "\n" + roff(command.get_description()) + ".\n";
  text += roff_paragraphs(command.get_footer()) + ".PP\nOptions:\n";
  for (const CLI::Option* option : options_of(command)) text += roff_option(*option);
  return text;
}

}  // namespace

std::string man_page(const CLI::App& app) {
  const std::string& name = app.get_name();
  std::string summary = app.get_description();
  while (!summary.empty() && summary.back() == '.') summary.pop_back();
  std::string text = fmt::format(".TH {} 1 {} \"swarmcert {}\" \"User Commands\"\n", "SWARMCERT",
                                 SWARMCERT_RELEASE_DATE, SWARMCERT_VERSION);
  text += ".SH NAME\n" + name + " \\- " + roff(summary) + "\n";
  text += ".SH SYNOPSIS\n" + bold(name) + " " + italic("COMMAND") + " [" + italic("options") + "]\n";
  text += ".SH OPTIONS\n";
  for (const CLI::Option* option : options_of(app)) text += roff_option(*option);
  text += ".SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) text += roff_command(*command);
  text += ".SH \"EXIT STATUS\"\n" + roff_paragraphs(app.get_footer(), true);
  return text;
}

// --- bash ---

std::string bash_completion(const CLI::App& app) {
  const std::string& name = app.get_name();
  const auto all_names = [](const CLI::App& scope) {
    std::vector<std::string> words;
    for (const CLI::Option* option : options_of(scope)) {
      for (const std::string& word : names_of(*option)) words.push_back(word);
    }
    return words;
  };
  std::vector<std::string> first = all_names(app);
  std::string options, choices;
  for (const CLI::App* command : commands_of(app)) {
    first.push_back(command->get_name());
    options +=
        fmt::format("    {}) options='{}' ;;\n", command->get_name(), fmt::join(all_names(*command), " "));
    for (const CLI::Option* option : options_of(*command)) {
      const Value value = value_of(*option);
      if (value.choices.empty()) continue;
      // A positional argument comes after the command or a flag.
      const std::vector<std::string> before =
          option->get_positional() ? std::vector<std::string>{command->get_name()} : names_of(*option);
      for (const std::string& word : before) {
        choices += fmt::format("    '{} {}') choices='{}' ;;\n", command->get_name(), word,
                               fmt::join(value.choices, " "));
      }
    }
  }
  return fmt::format(R"(# Completion for bash, made by '{name} --bash-completion'.
_{name}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} word command='' options='' choices=''
  COMPREPLY=()
  # --name=value arrives in three words.
  if [[ $current == = ]]; then
    current=''
  elif [[ $before == = ]]; then
    before=${{COMP_WORDS[COMP_CWORD-2]}}
  fi
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    if [[ $word != -* ]]; then
      command=$word
      break
    fi
  done
  case $command in
    '') options='{first}' ;;
{options}  esac
  case "$command $before" in
{choices}    *) ;;
  esac
  if [[ -n $choices && $current != -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
  elif [[ -z $command || $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
  fi
}}
complete -o default -F _{name} {name}
)",
                     fmt::arg("name", name), fmt::arg("first", fmt::join(first, " ")),
                     fmt::arg("options", options), fmt::arg("choices", choices));
}

}  // namespace swarmcert::analysis

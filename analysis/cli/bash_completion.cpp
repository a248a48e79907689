#include "analysis/cli/bash_completion.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "nn/base/text.h"

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

/// Returns the values of an option that has a fixed list of them, which CLI11 writes as "TEXT:{auto,sdp}".
std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.rfind('}');
  if (option.get_expected_max() == 0 || open == std::string::npos || close == std::string::npos) return {};
  return files::split_at_commas(type.substr(open + 1, close - open - 1));
}

}  // namespace

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
      const std::vector<std::string> values = choices_of(*option);
      if (values.empty()) continue;
      // A positional argument follows the command or a flag.
      const std::vector<std::string> before =
          option->get_positional() ? std::vector<std::string>{command->get_name()} : names_of(*option);
      for (const std::string& word : before) {
        choices +=
            fmt::format("    '{} {}') choices='{}' ;;\n", command->get_name(), word, fmt::join(values, " "));
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

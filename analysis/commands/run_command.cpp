#include "analysis/commands/run_command.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <regex>

#include "analysis/cli/bash_completion.h"
#include "analysis/cli/command_line.h"
#include "analysis/commands/commands.h"
#include "nn/base/suggest.h"

namespace swarmcert::analysis {
namespace {

/// Rewrites the parser's message about an open range, which shows all digits of the largest number. Returns an empty
/// string for other messages.
std::string explain_range(const CLI::App& scope, const std::string& message) {
  static const std::regex pattern("(-[^:]*): Value (.*) not in range .* to [0-9]{19,}(\\.0*)?");
  std::smatch found;
  if (!std::regex_match(message, found, pattern)) return "";
  const std::string name = found[1];
  const std::string value = found[2];
  char* end = nullptr;
  const double number = std::strtod(value.c_str(), &end);
  if (end == value.c_str() || *end != '\0') return fmt::format("{} {}: is not a number", name, value);
  if (!std::isfinite(number)) return fmt::format("{} {}: must be a finite number", name, value);
  const CLI::Option* option = scope.get_option_no_throw(name);
  const bool is_positive = option != nullptr && option->get_type_name().find("POSITIVE") != std::string::npos;
  return fmt::format("{} {}: must {}", name, value, is_positive ? "be positive" : "not be negative");
}

/// Describes what the parser did not understand, with the option or command that was probably meant.
std::string explain(const CLI::App& app, const CLI::ParseError& error, int argc, const char* const* argv) {
  const auto* extras = dynamic_cast<const CLI::ExtrasError*>(&error);
  const CLI::App* scope = &app;
  for (const CLI::App* sub : app.get_subcommands()) scope = sub;
  std::vector<std::string> known;
  if (scope == &app && argc > 1 && argv[1][0] == '-') {
    for (const CLI::Option* option : app.get_options())
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    return fmt::format("unknown option {}: {}", argv[1], files::did_you_mean(argv[1], known));
  }
  if (scope == &app) {
    for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
      known.push_back(sub->get_name());
    }
    if (argc > 1) {
      return fmt::format("unknown command {}: {}", argv[1], files::did_you_mean(argv[1], known));
    }
  }
  for (const CLI::Option* option : scope->get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  // A required option may be missing because it was misspelled.
  if (extras == nullptr && dynamic_cast<const CLI::RequiredError*>(&error) == nullptr) {
    const std::string range = explain_range(*scope, error.what());
    return range.empty() ? error.what() : range;
  }
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::string name = word.substr(0, word.find('='));
    const bool is_known = std::find(known.begin(), known.end(), name) != known.end();
    if (word.rfind("--", 0) == 0 && !is_known) {
      return fmt::format("unknown option {}: {}", name, files::did_you_mean(name, known));
    }
  }
  return error.what();
}

void declare_common(CLI::App& app, CommonOptions& common) {
  add_output(app, "--json", common.json, "Write the result as JSON to this file; - for standard output");
  leave_out_of_record(
      app.add_option("-j,--jobs", common.jobs, "Number of threads; does not affect results (default: all)"))
      ->check(CLI::NonNegativeNumber);
  leave_out_of_record(app.add_flag("--force", common.force, "Replace files that exist"));
  leave_out_of_record(app.add_flag("-q,--quiet", common.quiet, "No progress on standard error"));
}

/// Range checks accept NaN, which no option supports. Where negative numbers are not allowed, the parser wraps them
/// to huge numbers.
void refuse_nan_and_wrapped(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_type_name().rfind("UINT", 0) == 0) {
      for (const std::string& value : option->results())
        if (value[0] == '-') throw UsageError(option->get_name() + " " + value + ": must not be negative");
    }
    if (option->get_type_name().rfind("FLOAT", 0) != 0) continue;
    for (std::string value : option->results()) {
      std::transform(value.begin(), value.end(), value.begin(),
                     [](unsigned char c) { return std::tolower(c); });
      if (value.substr(value.find_first_not_of("+-") == std::string::npos ? 0 : value.find_first_not_of("+-"),
                       3) == "nan")
        throw UsageError(option->get_name() + " " + value + ": give a number");
    }
  }
}

}  // namespace

int run_command(int argc, const char* const* argv) {
  CLI::App app("Formal verification and analysis for learned multirotor controllers.", "swarmcert");
  app.require_subcommand(1);
  app.set_version_flag("--version", "swarmcert " SWARMCERT_VERSION);
  app.footer(
      "Exit codes: 0 done or holds; 1 a limit is violated, or something is refuted or rejected; 2 usage; 3 "
      "bad input;\n"
      "4 inconclusive; 70 internal error.  'swarmcert COMMAND --help' shows options and an example.");
  app.add_flag_callback(
      "--bash-completion", [&app] { throw CLI::CallForVersion(bash_completion(app), 0); },
      "Print the completion for bash: source <(swarmcert --bash-completion)");
  CommonOptions common;
  std::function<int(const CommonOptions&)> action;
  int declared = 0;
  for (const Command& command : commands()) {
    CLI::App* sub = app.add_subcommand(command.name, command.summary);
    sub->group(declared++ < kFirstCommands ? "Start with" : "Further commands");
    sub->footer(command.details);
    declare_common(*sub, common);
    auto to_run = command.declare(*sub);
    sub->callback([&action, to_run] { action = to_run; });
  }
  if (argc < 2) throw UsageError("name a command; 'swarmcert --help' lists them");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    throw UsageError(explain(app, error, argc, argv));
  }
  for (const CLI::App* sub : app.get_subcommands()) {
    refuse_nan_and_wrapped(*sub);
    refuse_shared_output(*sub);
    remember_command_line(argc, argv, *sub);
  }
  return action(common);
}

}  // namespace swarmcert::analysis

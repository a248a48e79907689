/// @file The manual page and the bash completion, made from the commands as they are declared.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace swarmcert::analysis {

/// The manual page of `app` and all its commands, in man(7) macros: what --help says, command by command.
std::string man_page(const CLI::App& app);

/// A script for bash that completes commands, options, and the values of options that have a list of them; files
/// elsewhere.
std::string bash_completion(const CLI::App& app);

}  // namespace swarmcert::analysis

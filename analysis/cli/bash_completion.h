/// @file The completion for bash, made from the commands as they are declared.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace swarmcert::analysis {

/// A script for bash that completes commands, options, and the values of options that have a list of them; files
/// elsewhere.
std::string bash_completion(const CLI::App& app);

}  // namespace swarmcert::analysis

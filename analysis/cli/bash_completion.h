/// @file The completion for bash, generated from the declared commands.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace swarmcert::analysis {

/// Returns a bash script that completes commands, options, and the values of options with a fixed list of values;
/// everything else completes to file names.
std::string bash_completion(const CLI::App& app);

}  // namespace swarmcert::analysis

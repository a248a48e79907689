/// @file The command line as results and reports repeat it.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::analysis {

/// Remembers the command line for the functions below.
void remember_command_line(int argc, const char* const* argv);

/// Its words without what may not change the result: --jobs, -q, --force and where output goes. Empty if there is none.
const std::vector<std::string>& command_line();

/// The same as a line to paste into a shell, with `-o OUTPUT` and `--report REPORT` where these were named.
std::string command_to_copy();

}  // namespace swarmcert::analysis

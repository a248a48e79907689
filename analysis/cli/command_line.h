/// @file The command line as results and reports repeat it, and options that are left out of it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace swarmcert::analysis {

/// Declares an option that names a file or folder to be written. Outputs are not part of the recorded command line,
/// and two outputs of one command must not name the same path (refuse_shared_output()).
CLI::Option* add_output(CLI::App& app, const std::string& names, std::string& path,
                        const std::string& description);

/// Marks an option that cannot change the result (--jobs, --quiet, --force, ...): it is not recorded.
CLI::Option* leave_out_of_record(CLI::Option* option);

/// @throws UsageError if two outputs of the parsed `command` name the same path: one of them would be lost.
void refuse_shared_output(const CLI::App& command);

/// Remembers the command line of the parsed `command` for the functions below.
void remember_command_line(int argc, const char* const* argv, const CLI::App& command);

/// Its words without outputs and without what leave_out_of_record() marks. Empty if nothing was remembered.
const std::vector<std::string>& command_line();

/// The same as a line to paste into a shell, with `-o OUTPUT` and `--report REPORT` where these were named.
std::string command_to_copy();

}  // namespace swarmcert::analysis

/// @file The command line as recorded in results and reports, and the options that are not recorded.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace swarmcert::analysis {

/// Declares an option that names an output file or folder. Outputs are not part of the recorded command line,
/// and two outputs of one command must not name the same path (see refuse_shared_output()).
CLI::Option* add_output(CLI::App& app, const std::string& names, std::string& path,
                        const std::string& description);

/// Marks an option that cannot change the result (--jobs, --quiet, --force, ...); it is not recorded.
CLI::Option* leave_out_of_record(CLI::Option* option);

/// @throws UsageError if two outputs of the parsed `command` name the same path, since one would overwrite the other.
void refuse_shared_output(const CLI::App& command);

/// Stores the command line of the parsed `command` for the functions below.
void remember_command_line(int argc, const char* const* argv, const CLI::App& command);

/// Returns the words of the stored command line without outputs and without options marked by
/// leave_out_of_record(). Empty if no command line was stored.
const std::vector<std::string>& command_line();

/// Returns the same as a line to paste into a shell, with `-o OUTPUT` and `--report REPORT` in place of named outputs.
std::string command_to_copy();

}  // namespace swarmcert::analysis

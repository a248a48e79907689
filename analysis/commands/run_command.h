/// @file One command line, from its words to its exit code.
#pragma once

namespace swarmcert::analysis {

/// Parses the words of a command line and runs the command that they name, for the host of the calling thread if
/// there is one (cli/host.h). Help and manual pages go to standard output.
/// @param argv argv[0] is the program, argv[1] the command; [argc].
/// @return an ExitCode; invalid input throws.
/// @throws UsageError if the words cannot be parsed, files::InputError, and other exceptions of the command.
int run_command(int argc, const char* const* argv);

}  // namespace swarmcert::analysis

/// @file One command line, from its words to its exit code.
#pragma once

namespace swarmcert::analysis {

/// Parses the words as the command line does and runs the command that they name, for the host of the calling thread if
/// there is one (cli/host.h). Help and pages go to standard output.
/// @param argv argv[0] is the program, argv[1] the command; [argc].
/// @return an ExitCode; wrong input is an exception.
/// @throws UsageError where the words cannot be understood, files::InputError and what else the command throws.
int run_command(int argc, const char* const* argv);

}  // namespace swarmcert::analysis

/// @file The commands of the tool. To add a command: its folder, its declaration here, its line in commands.cpp.
#pragma once

#include <vector>

#include "analysis/cli/command.h"

namespace swarmcert::analysis {

/// Number of commands that --help lists first.
inline constexpr int kFirstCommands = 10;

/// Returns all commands in the order in which --help lists them.
const std::vector<Command>& commands();

Command add_command();
Command bound_command();
Command certify_command();
Command check_command();
Command compare_command();
Command demo_command();
Command diagnose_command();
Command explain_command();
Command export_command();
Command gate_command();
Command identify_thrust_command();
Command inspect_command();
Command iss_check_command();
Command match_command();
Command merge_command();
Command model_command();
Command reproduce_command();
Command schema_command();
Command simulate_command();
Command spacing_command();
Command study_command();
Command sweep_command();
Command train_command();
Command tune_command();
Command verify_bundle_command();

}  // namespace swarmcert::analysis

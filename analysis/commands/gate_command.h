/// @file The commands that judge a release.
#pragma once

#include "analysis/commands/command.h"

namespace swarmcert::analysis {

Command gate_command();
Command verify_bundle_command();

}  // namespace swarmcert::analysis

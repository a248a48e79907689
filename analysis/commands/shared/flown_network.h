/// @file NET as stored by flight code, in float32.
#pragma once

#include <string>

#include "analysis/cli/command.h"

namespace swarmcert::analysis {

/// Declares --as.
void declare_as(CLI::App& app, std::string& as);

/// Loads NET. Rounds float64 weights if `as` is "float32"; `is_rounded` tells whether any were rounded.
/// @throws files::InputError for float64 weights otherwise, since rounding changes the function.
files::Network load_flown_net(const files::NetworkArguments& arguments, const std::string& as,
                              bool& is_rounded);

}  // namespace swarmcert::analysis

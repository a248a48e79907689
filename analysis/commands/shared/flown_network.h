/// @file NET as flight code holds it: in float32.
#pragma once

#include <string>

#include "analysis/cli/command.h"

namespace swarmcert::analysis {

/// Declares --as.
void declare_as(CLI::App& app, std::string& as);

/// Loads NET. Weights in float64 are rounded where `as` is "float32"; `is_rounded` tells whether any were.
/// @throws files::InputError for float64 weights otherwise: rounding changes the function.
files::Network load_flown_net(const files::NetworkArguments& arguments, const std::string& as,
                              bool& is_rounded);

}  // namespace swarmcert::analysis

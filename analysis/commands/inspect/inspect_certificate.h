/// @file Reads what a certificate states; nothing is checked.
#pragma once

#include <string>

#include "analysis/commands/inspect/inspect_result.h"

namespace swarmcert::analysis {

/// Reads a certificate of network bounds, or of the gains of position loops.
/// @throws files::InputError for any other JSON.
InspectedFile stated_by_certificate(const std::string& path);

}  // namespace swarmcert::analysis

/// @file Statements of a certificate as shown by `inspect`; nothing is checked.
#pragma once

#include <string>

#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Describes a certificate of network bounds (kind "certificate") or of the gains of position loops (kind
/// "tracking_certificate").
/// @throws files::InputError for any other JSON.
files::Json inspect_certificate(const std::string& path, bool print);

}  // namespace swarmcert::analysis

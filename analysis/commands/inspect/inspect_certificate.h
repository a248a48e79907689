/// @file What a certificate states, as `inspect` shows it; nothing is checked.
#pragma once

#include <string>

#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Of bounds of networks (kind "certificate") or of gains of position loops (kind "tracking_certificate").
/// @throws files::InputError for any other JSON.
files::Json inspect_certificate(const std::string& path, bool print);

}  // namespace swarmcert::analysis

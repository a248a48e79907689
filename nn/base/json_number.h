/// @file Possibly non-finite numbers in JSON.
#pragma once

#include <cmath>

#include "nn/base/json.h"

namespace swarmcert::files {

/// Returns x, or null if it is infinite or NaN, which JSON cannot represent.
inline Json finite(double x) { return std::isfinite(x) ? Json(x) : Json(); }

}  // namespace swarmcert::files

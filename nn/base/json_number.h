/// @file Numbers that need not be finite, in JSON.
#pragma once

#include <cmath>

#include "nn/base/json.h"

namespace swarmcert::files {

/// x, or null where it is infinite or NaN: JSON has neither.
inline Json finite(double x) { return std::isfinite(x) ? Json(x) : Json(); }

}  // namespace swarmcert::files

/// @file Points at which the float32 evaluation is far from the exact function: a search whose best point is evaluated
/// exactly.
#pragma once

#include <cstdint>

#include "lipschitz/base/box.h"
#include "lipschitz/values/range.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

struct Float32Search {
  int starts = 8;  ///< climbs, each of about fifteen thousand evaluations
  std::uint64_t seed = 1;
};

/// `value` is |f32(x) - f(x)|_2 at float32 points of the box, in exact arithmetic, rounded down: a lower bound of
/// Float32Error::evaluation. Empty points where the box holds no float32. Rounding errors are rough: they follow the
/// sizes of values and slopes over long distances, and chance over short ones. So a climb first moves a cloud of points
/// to where errors are large, then its worst point by steps of all sizes, down to neighbouring floats.
/// @param function "network" or a set function, with exactly `neighbours` neighbours and the ground's input.
/// @param domain by part, finite, as it leaves the clamp; NET has no invariants and is stored in float32.
Attained float32_error_found(const files::Network& network, const Domain& domain,
                             const files::FunctionId& function, int neighbours, const Float32Search& search);

}  // namespace swarmcert::lipschitz

/// @file Points at which the float32 evaluation is far from the exact function: a search whose best point is evaluated
/// exactly.
#pragma once

#include <cstdint>

#include "lipschitz/base/box.h"
#include "lipschitz/values/range.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

struct Float32Search {
  int starts = 8;  ///< number of local searches, each of about fifteen thousand evaluations
  std::uint64_t seed = 1;
};

/// Returns float32 points of the box and `value` = |f32(x) - f(x)|_2 there, computed exactly and rounded down: a lower
/// bound on Float32Error::evaluation. The points are empty if the box contains no float32. Round-off errors follow the
/// magnitudes of values and slopes over long distances, and look random over short ones. A local search therefore first
/// moves a set of points to a region with large errors, and then its worst point with steps of all sizes, down to
/// neighbouring floats.
/// @param function "network" or a set function, with exactly `neighbours` neighbours and the ground's input.
/// @param domain by part, finite, after the clamp. NET is stored in float32.
Attained float32_error_found(const files::Network& network, const Domain& domain,
                             const files::FunctionId& function, int neighbours, const Float32Search& search);

}  // namespace swarmcert::lipschitz

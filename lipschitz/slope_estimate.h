/// @file The steepest slope that sampling finds, for networks whose values are not exact numbers: an estimate, no
/// bound.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "lipschitz/box.h"
#include "lipschitz/checker/bounds.h"
#include "lipschitz/claims.h"
#include "lipschitz/stop.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

struct SlopeEstimateOptions {
  std::uint64_t seed = 1;
  std::map<std::string, Box> domain;  ///< by part, as the claim's; empty: all inputs
  int starts = 24;  ///< random points, from each of which the slope is climbed; fewer for large networks
  Stop stop;
};

/// The largest difference quotient |f(x) - f(y)| / |x - y| that was found for the claim, in its block, norm and box; of
/// a set function with up to two more neighbours and the ground. Evaluated in double: it proves nothing, but a proved
/// upper bound that lies close to it cannot be improved by much.
Estimate slope_estimate(const files::Network& network, const Claim& claim,
                        const SlopeEstimateOptions& options);

}  // namespace swarmcert::lipschitz

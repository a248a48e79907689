/// @file Places where a function is steep, found by sampling in double: an estimate, no bound.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/base/claims.h"
#include "lipschitz/base/stop.h"
#include "lipschitz/checker/bounds.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

struct SlopeEstimateOptions {
  std::uint64_t seed = 1;
  Domain domain;             ///< by part, as the claim's; empty: all inputs
  std::optional<Box> moved;  ///< where the input that moves lies, instead of the domain's box of its part
  int starts = 24;  ///< random points, from each of which the slope is climbed; fewer for large networks
  Stop stop;        ///< a start that it cuts short counts for nothing, unless it is the first
};

/// Where a search ended: x +- half_step d, d the direction, are points of the domain between which the slope is about
/// `slope`.
struct SteepPlace {
  Estimate slope{0};
  Eigen::VectorXd x, direction;  ///< [inputs]; the direction is in the block, of length 1 in the claim's norm
  double half_step = 0;          ///< in the claim's norm
  /// Of a set function: the networks whose terms do not move, "phi:<kind>" each, and where these are.
  std::vector<files::FunctionId> other_networks;
  std::vector<Eigen::VectorXd> others;
  int starts = 0;            ///< that were finished
  bool interrupted = false;  ///< stopped before all starts were
};

/// The place of the steepest difference quotient |f(x) - f(y)| / |x - y| that was found for the claim, in its block,
/// norm and box; of a set function with up to two more neighbours and the ground. From each start x goes to better
/// random points ever closer to it, then up the gradient of the quotient along the direction of the largest gain, with
/// points closer together at last. Evaluated in double: it proves nothing. No direction (zero) where nothing may move.
SteepPlace steep_place(const files::Network& network, const Claim& claim,
                       const SlopeEstimateOptions& options);

/// The quotient there: a proved upper bound that lies close to it cannot be improved by much.
Estimate slope_estimate(const files::Network& network, const Claim& claim,
                        const SlopeEstimateOptions& options);

}  // namespace swarmcert::lipschitz

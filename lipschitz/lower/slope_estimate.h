/// @file Points where a function is steep, found by sampling in double: an estimate, not a bound.
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
  Domain domain;    ///< the claim's domain, by part; empty: all inputs
  int starts = 24;  ///< number of random points from which the slope is ascended; fewer for large networks
  Stop stop;        ///< a start that is cut short is discarded unless it is the first
};

/// Result of a search: x + half_step d and x - half_step d, with direction d, are points of the domain between which
/// the slope is about `slope`.
struct SteepPlace {
  Estimate slope{0};
  Eigen::VectorXd x, direction;  ///< [inputs]; the direction is in the block, of length 1 in the claim's norm
  double half_step = 0;          ///< in the claim's norm
  /// For a set function: the networks of the terms that do not move, "phi:<kind>" each, and their inputs.
  std::vector<files::FunctionId> other_networks;
  std::vector<Eigen::VectorXd> others;
  int starts = 0;            ///< number of finished starts
  bool interrupted = false;  ///< stopped before all starts were finished
};

/// Returns the points of the steepest difference quotient |f(x) - f(y)| / |x - y| found for the claim in its block,
/// norm and box; for a set function, with up to two more neighbours and the ground. From each start, x first moves to
/// better random points at decreasing distances, then along the gradient of the quotient in the direction of the
/// largest gain, finally with a smaller distance of the points. Evaluated in double: the result proves nothing. The
/// direction is zero if no input can move.
SteepPlace steep_place(const files::Network& network, const Claim& claim,
                       const SlopeEstimateOptions& options);

/// Returns the quotient of steep_place(). A proved upper bound close to it cannot be improved by much.
Estimate slope_estimate(const files::Network& network, const Claim& claim,
                        const SlopeEstimateOptions& options);

}  // namespace swarmcert::lipschitz

/// @file Lipschitz bounds on a box, part by part, for activations other than ReLU.
#pragma once

#include "lipschitz/branch/local_bound.h"

namespace swarmcert::lipschitz {

/// Bounds `claim`, which has no number of neighbours, on `box`, the range of the moving input after the clamp.
///
/// Halves the box, best first. The slopes of each neuron over a part (check::slopes_on_box()) give the matrix
/// inequality of BentChain there; smaller parts have narrower slope ranges. The part with the largest bound is halved
/// along the input that moves the neurons with wide ranges the most. In the end, every part is proved for one rho by
/// check::check_slope_tree().
/// @param options `nodes` 0: as many as take seconds; `known`, `tolerance`, `seconds`, `jobs`, `cancelled` and
///   `progress` as in branch(). If `seconds` is not set, the result depends on the options only.
/// @returns no proof for rho alone, for layers that sort, and for more variables than kMostBentVariables.
LocalBound slope_parts(const files::Network& network, const Claim& claim, const Box& box,
                       const BranchOptions& options);

}  // namespace swarmcert::lipschitz

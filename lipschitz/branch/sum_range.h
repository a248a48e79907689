/// @file Range of a neighbour's term over its box, with a proof: the contribution of neighbours that do not move.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/checker/box_states.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// least <= y <= most for the outputs y of a chain over a box, proved by check::check_range() with `tree`.
struct RangeProof {
  std::string tree;
  std::vector<double> least, most;
};

/// Converts the layers for a search. The additional term in [least, most] becomes a bias and its radius.
ReachNetwork reach_layers(const std::vector<check::HiddenLayer>& layers);

/// Returns the hull of the outputs over up to `nodes` parts of the box. Always halves the part with the widest range,
/// along the coordinate on which its linear forms depend most.
/// @param layers the last one without ReLU.
RangeProof sum_range(const std::vector<check::HiddenLayer>& layers, const Box& box, int nodes);

}  // namespace swarmcert::lipschitz

/// @file Contribution of neighbours that do not move: the range of a term over its box, with its proof.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/checker/box_states.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// least <= y <= most for the outputs y of a chain over a box, shown by check::check_range() with `tree`.
struct RangeProof {
  std::string tree;
  std::vector<double> least, most;
};

/// The same layers for a search. What enters besides, [least, most], becomes a bias and its radius.
ReachNetwork reach_layers(const std::vector<check::HiddenLayer>& layers);

/// The hull of the outputs over up to `nodes` parts of the box: always halves the part with the widest range, where its
/// linear forms depend on it most.
/// @param layers the last one without ReLU.
RangeProof sum_range(const std::vector<check::HiddenLayer>& layers, const Box& box, int nodes);

}  // namespace swarmcert::lipschitz

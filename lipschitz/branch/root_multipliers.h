/// @file Initial multipliers of a search.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/branch/local_chain.h"
#include "lipschitz/branch/node_inequality.h"

namespace swarmcert::lipschitz {

/// Multipliers for a box that inherits none: those given, improved, or where they prove nothing or there are none,
/// those of the whole program.
/// @param start one per hidden neuron of the network, in its own units; or empty.
Eigen::VectorXd root_multipliers(const LocalChain& chain, const NodeInequality& inequality,
                                 const std::vector<double>& start);

}  // namespace swarmcert::lipschitz

/// @file Initial multipliers of a search.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/base/stop.h"
#include "lipschitz/branch/local_chain.h"
#include "lipschitz/solver/node_inequality.h"

namespace swarmcert::lipschitz {

/// Returns multipliers for a box that inherits none: the given ones, improved, or, if there are none or they prove
/// nothing, the solution of the full semidefinite program.
/// @param start one per hidden neuron of the network, in its own units; or empty.
/// @param stop ends the solution early, at multipliers that prove less.
Eigen::VectorXd root_multipliers(const LocalChain& chain, const NodeInequality& inequality,
                                 const std::vector<double>& start, const Stop& stop);

}  // namespace swarmcert::lipschitz

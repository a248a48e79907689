/// @file Heuristic search for points where a function of sums is large. It proves nothing.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// A number of equal inputs of one network.
struct PlacedTerm {
  const ReachNetwork* network;
  const Box* box;
  int count;
};

/// Returns points x_k in their boxes at which direction rho(sum_k count_k phi_k(x_k)) is about largest: starts at the
/// best of random points and of `starts` and takes random steps of decreasing size. Deterministic.
/// @param rho empty: the identity.
/// @param starts each with one x_k per term.
std::vector<Eigen::VectorXd> climb(const std::vector<PlacedTerm>& terms, const ReachNetwork& rho,
                                   const Eigen::RowVectorXd& direction,
                                   const std::vector<std::vector<Eigen::VectorXd>>& starts);

}  // namespace swarmcert::lipschitz

/// @file Points where a function of sums is large: a search that proves nothing.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// Some inputs of one network, all in one place of its box.
struct PlacedTerm {
  const ReachNetwork* network;
  const Box* box;
  int count;
};

/// About where direction rho(sum_k count_k phi_k(x_k)) is largest, x_k in its box: the best of random points and of
/// `starts`, and random steps from there that shrink. The same for the same arguments.
/// @param rho empty: the identity.
/// @param starts one x_k per term each.
std::vector<Eigen::VectorXd> climb(const std::vector<PlacedTerm>& terms, const ReachNetwork& rho,
                                   const Eigen::RowVectorXd& direction,
                                   const std::vector<std::vector<Eigen::VectorXd>>& starts);

}  // namespace swarmcert::lipschitz

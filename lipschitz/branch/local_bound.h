/// @file Lipschitz bounds on a box, proved part by part.
#pragma once

#include <map>
#include <optional>

#include "lipschitz/base/claims.h"
#include "lipschitz/branch/branch.h"
#include "lipschitz/branch/rho_form.h"
#include "lipschitz/branch/sum_range.h"
#include "lipschitz/checker/bounds.h"
#include "lipschitz/checker/tree_proof.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// A proof of |f(x) - f(y)| <= sqrt(rho) |x - y| on the box.
struct LocalProof {
  double rho = 0;
  std::optional<RhoForm> form;  ///< for a set function with any number of neighbours
  /// For a set function with a stated number of neighbours: the ranges of the other terms, by "phi:<kind>".
  std::optional<std::map<files::FunctionId, RangeProof>> others;
  std::vector<double> radius;  ///< radius of the projective cover if the bound holds everywhere; else empty
  check::TreeProof tree;
};

struct LocalBound {
  std::optional<LocalProof> proof;  ///< nothing if the checker did not accept the result of the search
  UpperBound upper{0};              ///< sqrt(rho), rounded up
  BranchStop stop = BranchStop::kNothingRun;
  int nodes = 0;                 ///< boxes examined
  double undecided_per_box = 0;  ///< see BranchResult
  long leaves = 0;
  Outlook outlook;
  std::vector<Eigen::VectorXd> steep_centres;  ///< see BranchResult
};

/// Bounds `claim` for pairs of inputs in its box, or for all inputs by a projective cover.
///
/// The function is a plain network, phi, or a set function with one neighbour that moves in the box. For a set function
/// with any number of other neighbours anywhere, rho is replaced by a RhoForm. For claims with a stated number of
/// neighbours, rho is replaced by forms that hold in parts of the box (check::Form); the contribution of the other
/// neighbours to the first layer of rho is an interval, proved over parts of the box of each kind.
///
/// Branch and bound proposes the proof and check::check_tree() verifies it: every returned proof has been accepted.
/// @param domain by part; for all kinds if the claim has a number of neighbours.
/// @param joint_t multipliers of the claim's global bound (UpperProof::t). Empty: none; then there is no proof for a
///   set function with any number of neighbours.
/// Of functions with other activations than ReLU, on a box only: see slope_parts().
/// @param options `nodes` 0: as many as take seconds.
/// @returns no proof for functions without hidden layers and for rho alone.
LocalBound local_bound(const files::Network& network, const Claim& claim, const Domain& domain,
                       const std::vector<double>& joint_t, const BranchOptions& options);

/// The same for a claim without a number of neighbours; `box` is the range of the moving input.
LocalBound local_bound(const files::Network& network, const Claim& claim, const Box& box,
                       const std::vector<double>& joint_t, const BranchOptions& options);

}  // namespace swarmcert::lipschitz

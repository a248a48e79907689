/// @file A Lipschitz bound that holds on a box only, proved part by part.
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

/// What shows |f(x) - f(y)| <= sqrt(rho) |x - y| on the box.
struct LocalProof {
  double rho = 0;
  std::optional<RhoForm> form;  ///< of a set function with any number of neighbours
  /// Of a set function with so many neighbours: the ranges of the other terms, by "phi:<kind>".
  std::optional<std::map<files::FunctionId, RangeProof>> others;
  std::vector<double> radius;  ///< of the projective cover, where the bound holds everywhere; else empty
  check::TreeProof tree;
};

struct LocalBound {
  std::optional<LocalProof> proof;  ///< nothing where the checker did not accept what the search found
  UpperBound upper{0};              ///< sqrt(rho), rounded up
  BranchStop stop = BranchStop::kNothingRun;
  int nodes = 0;                 ///< boxes looked at
  double undecided_per_box = 0;  ///< as BranchResult has it
  long leaves = 0;
  Outlook outlook;
  std::vector<Eigen::VectorXd> steep_centres;  ///< as BranchResult has them
};

/// Bound of `claim` for inputs in its box, both ends of the slope, or for all inputs by a projective cover: of a plain
/// network or of phi; of a set function with one neighbour moving in the box, whatever the number and the places of the
/// others, through a RhoForm. For claims with a number of neighbours: through forms of rho that
/// hold in parts of the box (check::Form), with what the others add before its first ReLU as an interval, shown by the
/// parts of each kind's box.
///
/// Branch and bound proposes, check::check_tree() verifies: what is returned has been accepted.
/// @param domain by part; of all kinds where the claim has a number of neighbours.
/// @param joint_t multipliers of the claim's global bound (UpperProof::t); empty: none, and then no proof for a set
///   function with any number of neighbours.
/// @returns no proof for functions without hidden layers, and for rho alone.
LocalBound local_bound(const files::Network& network, const Claim& claim, const Domain& domain,
                       const std::vector<double>& joint_t, const BranchOptions& options);

/// local_bound() for a claim without a number of neighbours on one box after the other: what these share is made once.
class LocalBounds {
 public:
  /// `claim` itself may be for all inputs; the network stays the caller's.
  LocalBounds(const files::Network& network, const Claim& claim, const std::vector<double>& joint_t);
  /// @param box of the moving input, as it leaves the clamp.
  LocalBound on(const Box& box, const BranchOptions& options) const;
  /// By a projective cover.
  LocalBound everywhere(const BranchOptions& options) const;

 private:
  /// @param radius of the cover that `boxes` are; empty: they are none.
  LocalBound over(const check::LocalFunction& f, const LocalChain& chain,
                  const std::vector<check::Sides>& boxes, const std::vector<double>& radius,
                  BranchOptions options) const;

  bool has_bound_ = false;
  std::optional<RhoForm> form_;
  check::LocalFunction f_;
  LocalChain chain_;
  std::vector<double> start_;
  double cover_radius_ = 1;
};

/// The same for a claim without a number of neighbours, whose box is that of the moving input.
LocalBound local_bound(const files::Network& network, const Claim& claim, const Box& box,
                       const std::vector<double>& joint_t, const BranchOptions& options);

}  // namespace swarmcert::lipschitz

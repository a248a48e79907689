/// @file Bounds on the values of one function over a box, for a given composition of neighbours.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/extremes.h"
#include "lipschitz/values/range.h"
#include "lipschitz/values/sum_climb.h"
#include "lipschitz/values/sum_support.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// Number of neighbours by network, "phi:<kind>".
using Composition = std::map<files::FunctionId, int>;

/// Candidate inputs of a sum's terms, one list per candidate: one point per neighbour, then the ground's.
using Candidates = std::vector<std::vector<Eigen::VectorXd>>;

/// Range of "network", "phi:<kind>" or a set function, output by output, for ranges(). Stores data that its searches
/// share.
class FunctionRange {
 public:
  /// @param domain inputs of each part, finite; the domain and the network must outlive this object.
  /// @param nodes number of boxes per search.
  FunctionRange(const files::Network& network, const Domain& domain, const files::FunctionId& function,
                int nodes, int jobs);

  Eigen::Index outputs() const { return parts_.at(names_.back())->outputs(); }
  /// Returns an upper bound on |phi|_2 over the box.
  double jump_norm();
  bool is_silent(const Composition& neighbours) const;

  /// Returns an upper bound on sign * f_output for exactly these neighbours and adds candidates at which the maximum
  /// may be attained.
  /// @param neighbours empty for a plain network.
  double largest(int output, double sign, const Composition& neighbours, Candidates& candidates);

  /// Returns the most extreme value at the candidates, computed exactly and rounded inwards.
  /// @param candidates with neighbours of the function's own kind only.
  Attained attained(int output, double sign, const Candidates& candidates) const;

 private:
  /// A network whose outputs are terms of the sum.
  struct Term {
    ReachNetwork network;
    std::unique_ptr<PartTree> tree;
  };

  /// Bounds on rho over the sums of a composition.
  struct Sums {
    SumSupport support;
    std::unique_ptr<const Reach> reach;
  };

  /// Networks and the number of their terms in the sum.
  using Terms = std::vector<std::pair<files::FunctionId, int>>;

  MaximiseOptions search_of_boxes() const;
  PartSearch search_of_forms(double share) const;
  const Term& term(const files::FunctionId& part);
  /// Returns the neighbours and the ground's term if there is one.
  Terms all_terms(const Composition& neighbours) const;
  const Sums& sums(const Composition& neighbours);
  Eigen::VectorXd middle(const files::FunctionId& part) const;
  std::vector<Eigen::VectorXd> middles(const Composition& neighbours) const;

  // Upper bounds on direction f. They add to `starts` the points at which the terms of the bounding function are
  // largest, one x per term.

  /// Bounds f for one neighbour, and the ground if there is one.
  double beside_one(const Eigen::RowVectorXd& direction, const Composition& neighbour, Candidates& starts);
  /// Returns whether there are several neighbours, all of one kind.
  bool is_alike(const Composition& neighbours) const;
  /// Bounds f for several neighbours of one kind by a network of one neighbour that is convex in the sum and tight
  /// where f is largest.
  double by_alike(const Eigen::RowVectorXd& direction, const Composition& neighbours, Candidates& starts);
  /// Bounds f by a linear form over the sums, f <= c s + d, and the largest values of its terms.
  double by_support(const Eigen::RowVectorXd& direction, const Composition& neighbours, Candidates& starts);

  std::vector<PlacedTerm> placed(const Terms& all);
  /// Climbs from `starts` with all neighbours of a kind at the same point, and adds the result to `candidates`.
  void propose(const Terms& all, const Eigen::RowVectorXd& direction, const Candidates& starts,
               Candidates& candidates);

  const files::Network& network_;
  const Domain& domain_;
  std::vector<files::FunctionId> names_;
  int nodes_, jobs_;
  files::FunctionId function_;
  files::Parts parts_;
  bool has_ground_ = false;
  ReachNetwork rho_;
  std::map<files::FunctionId, Term> terms_;
  std::map<Composition, Sums> sums_;
};

}  // namespace swarmcert::lipschitz

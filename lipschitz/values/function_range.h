/// @file Bounds on the values of one function over a box, among given neighbours.
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

/// How many neighbours there are, by network: "phi:<kind>".
using Composition = std::map<files::FunctionId, int>;

/// Points of the terms of a sum, one list per proposal: a point per neighbour, then the ground's.
using Candidates = std::vector<std::vector<Eigen::VectorXd>>;

/// "network", "phi:<kind>" or a set function: what ranges() asks of it, output by output. It keeps what its searches
/// share.
class FunctionRange {
 public:
  /// @param domain what each part sees, finite; it and the network must outlive this.
  /// @param nodes boxes per search.
  FunctionRange(const files::Network& network, const Domain& domain, const files::FunctionId& function,
                int nodes, int jobs);

  Eigen::Index outputs() const { return parts_.at(names_.back())->outputs(); }
  /// At least the largest |phi|_2 over the box.
  double jump_norm();
  bool is_silent(const Composition& neighbours) const;

  /// At least every value of sign * f_output among these neighbours, and no others; proposes points where it is
  /// attained. A plain network has none.
  double largest(int output, double sign, const Composition& neighbours, Candidates& candidates);

  /// The most extreme of the values at the candidates, exactly, rounded towards the others.
  /// @param candidates among neighbours of the function's own kind.
  Attained attained(int output, double sign, const Candidates& candidates) const;

 private:
  /// A network whose outputs are added up.
  struct Term {
    ReachNetwork network;
    std::unique_ptr<PartTree> tree;
  };

  /// rho over the sums among some neighbours.
  struct Sums {
    SumSupport support;
    std::unique_ptr<const Reach> reach;
  };

  /// Networks and how often each is in the sum.
  using Terms = std::vector<std::pair<files::FunctionId, int>>;

  MaximiseOptions search_of_boxes() const;
  PartSearch search_of_forms(double share) const;
  const Term& term(const files::FunctionId& part);
  /// The neighbours, and the ground's term where there is one.
  Terms all_terms(const Composition& neighbours) const;
  const Sums& sums(const Composition& neighbours);
  Eigen::VectorXd middle(const files::FunctionId& part) const;
  std::vector<Eigen::VectorXd> middles(const Composition& neighbours) const;

  // Bounds on direction f. `starts`: where the terms of what lies above f are largest, one x per term.

  /// One neighbour and the ground, if there is one.
  double beside_one(const Eigen::RowVectorXd& direction, const Composition& neighbour, Candidates& starts);
  /// Whether there are several neighbours, all of one kind.
  bool is_alike(const Composition& neighbours) const;
  /// Several neighbours of one kind: one neighbour of a network that is convex in the sum, tight where f is largest.
  double by_alike(const Eigen::RowVectorXd& direction, const Composition& neighbours, Candidates& starts);
  /// A linear form above rho over the sums, f <= c s + d, and the largest values of its terms.
  double by_support(const Eigen::RowVectorXd& direction, const Composition& neighbours, Candidates& starts);

  std::vector<PlacedTerm> placed(const Terms& all);
  /// Climbs from `starts`, all neighbours of a kind in one place.
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

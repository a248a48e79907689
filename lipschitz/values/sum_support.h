/// @file Maxima of linear forms over the sums that enter rho.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/values/part_tree.h"

namespace swarmcert::lipschitz {

/// The sums s = sum_k sum_j phi_k(x_kj) of outputs of several networks, with `count` terms of network k, each input
/// anywhere in its box:
///   max c s + d = sum_k count_k max_x c phi_k(x) + d.
/// Each maximum is computed by branch and bound over the box of one input, so the cost does not grow with the counts.
struct SumSupport {
  struct Term {
    PartTree* tree;
    int count;
  };
  std::vector<Term> terms;
  Eigen::Index size = 0;  ///< outputs of each network
  PartSearch search;

  /// Returns the bounding box of these sums, rounded outwards.
  Bounds bounds() const;
  /// Returns an upper bound on the largest value of each form.
  Eigen::VectorXd operator()(const LinearForms& forms) const;
  /// Returns one input per term at which the form is about largest.
  std::vector<Eigen::VectorXd> steepest(const Eigen::RowVectorXd& form) const;
};

/// Returns `constant` plus `count` times `term`, rounded up such that it bounds the sum in every order of summation.
double sum_rounded_up(double constant, int count, double term);

}  // namespace swarmcert::lipschitz

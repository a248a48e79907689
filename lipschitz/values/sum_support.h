/// @file Largest values of linear forms over the sums that enter rho.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/values/part_tree.h"

namespace swarmcert::lipschitz {

/// Sums s = sum_k sum_j phi_k(x_kj) of outputs of several networks, of network k as many as its `count`, each input
/// anywhere in its box:
///   max c s + d = sum_k count_k max_x c phi_k(x) + d,
/// each maximum by branch and bound over the box of one input: its cost does not grow with the counts.
struct SumSupport {
  struct Term {
    PartTree* tree;
    int count;
  };
  std::vector<Term> terms;
  Eigen::Index size = 0;  ///< outputs of each network
  PartSearch search;

  /// The box of these sums, rounded outwards.
  Bounds bounds() const;
  /// At least the largest value of each form.
  Eigen::VectorXd operator()(const LinearForms& forms) const;
  /// About where the one form is largest: an input for each term.
  std::vector<Eigen::VectorXd> steepest(const Eigen::RowVectorXd& form) const;
};

/// Adds `count` numbers `term` and `constant`, rounded up for every order of summation.
double sum_rounded_up(double constant, int count, double term);

}  // namespace swarmcert::lipschitz

/// @file Largest values of linear forms over the sums that enter rho.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/extremes.h"

namespace swarmcert::lipschitz {

/// Sums s = sum_j phi(x_j) + g(x_g) of `count` outputs of one network and at most one of another, each input anywhere
/// in its box:
///   max c s + d = count max_x c phi(x) + max_x c g(x) + d,
/// each maximum taken over the parts of its box, by a linear form on each.
struct SumSupport {
  const Hull* phi = nullptr;
  int count = 0;
  const Hull* ground = nullptr;  ///< null: none
  int jobs = 1;

  /// The box of these sums, rounded outwards.
  Bounds bounds() const;
  /// At least the largest value of each form.
  Eigen::VectorXd operator()(const LinearForms& forms) const;
};

/// Adds `count` numbers `term` and `constant`, rounded up for every order of summation.
double sum_rounded_up(double constant, int count, double term);

}  // namespace swarmcert::lipschitz

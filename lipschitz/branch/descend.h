/// @file Newton steps on the multipliers of a part, starting from those of its parent box.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/branch/node_inequality.h"

namespace swarmcert::lipschitz {

struct DescentOptions {
  double relative_gap = 0.02;  ///< of the barrier's centre to the least rho, about
  int steps = 3;               ///< Newton steps at most
};

/// Multipliers with a smaller NodeInequality::least_rho(), from feasible ones.
///
/// With R = rho I - (S_xx part) - S_xz S_zz^-1 S_zx, the Schur complement over the inputs, minimises
///   rho / mu - log det R - eps log det S_zz,
/// convex in (rho, t) since R is concave in them. The rank of the inputs, not the number of neurons, decides how far
/// the centre is from the optimum, and S^-1 = S_zz^-1 + W R^-1 W' (padded) gives the Hessian from the same few products
/// of matrices that the usual barrier -log det S needs; a step costs a fifth of one of minimise().
/// @param t one multiplier per undecided neuron, then one per pair, with S_zz > 0.
/// @returns `t` itself where nothing better was found. An estimate: the checker verifies.
Eigen::VectorXd descend(const NodeInequality& inequality, const Eigen::VectorXd& t,
                        const DescentOptions& options);

/// How much each pair's multiplier alone would take off the barrier, by its quadratic model at `t`.
std::vector<double> gains(const NodeInequality& inequality, const Eigen::VectorXd& t, double relative_gap);

}  // namespace swarmcert::lipschitz

/// @file Newton steps on the multipliers of a part, starting from those of its parent box.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/solver/node_inequality.h"

namespace swarmcert::lipschitz {

struct DescentOptions {
  double relative_gap = 0.02;  ///< approximate relative distance of the barrier's centre to the least rho
  int steps = 3;               ///< maximum number of Newton steps
};

/// Improves feasible multipliers: returns multipliers with a smaller NodeInequality::least_rho().
///
/// With R = rho I - (S_xx part) - S_xz S_zz^-1 S_zx, the Schur complement over the inputs, minimises
///   rho / mu - log det R - eps log det S_zz,
/// which is convex in (rho, t) because R is concave in them. The distance of the centre from the optimum depends on the
/// number of inputs, not on the number of neurons. With S^-1 = S_zz^-1 + W R^-1 W' (padded), the Hessian needs the same
/// few matrix products as the usual barrier -log det S. A step costs a fifth of a step of minimise().
/// @param t one multiplier per undecided neuron, then one per pair, with S_zz > 0.
/// @returns `t` itself if nothing better was found. An estimate: the checker verifies it.
Eigen::VectorXd descend(const NodeInequality& inequality, const Eigen::VectorXd& t,
                        const DescentOptions& options);

/// Returns for each pair the decrease of the barrier when only its multiplier changes, predicted by the quadratic model
/// at `t`.
std::vector<double> gains(const NodeInequality& inequality, const Eigen::VectorXd& t, double relative_gap);

}  // namespace swarmcert::lipschitz

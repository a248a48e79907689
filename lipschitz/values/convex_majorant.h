/// @file A convex upper bound of rho, as a ReLU network.
#pragma once

#include <Eigen/Core>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// Returns the network r(n phi(x)) with one output for x in a box, where r is convex and r(s) >= direction rho(s) for
/// every s. The output for n neighbours is then bounded by that for n equal neighbours:
///   direction rho(sum_j phi(x_j)) <= r(mean_j n phi(x_j)) <= max_j r(n phi(x_j)),   j = 1 .. n.
///
/// Each neuron z of rho has a convex upper bound U and a convex upper bound -L of -z, computed layer by layer. If
/// relu(z) has a positive weight, it is replaced by relu(U), which is convex because relu is convex and nondecreasing.
/// If it has a negative weight, -relu(z) <= -below z <= -below L, with `below` 0 or 1. r equals direction rho at every
/// s at which each neuron is on if its `below` is 1 and off if it is 0; `below` is chosen such that `touched` is one.
///
/// L passes layers without a ReLU; it is shifted such that it is positive on the box. Round-off errors of the shifts
/// and of n W are included in bias_radius.
/// @param phi its last layer has no ReLU.
/// @param direction 1 or -1 for one output, 0 for the others.
/// @param touched [outputs of phi], a sum at which r should be tight.
ReachNetwork convex_majorant(const ReachNetwork& phi, const Box& box, int n, const ReachNetwork& rho,
                             const Eigen::RowVectorXd& direction, const Eigen::VectorXd& touched);

}  // namespace swarmcert::lipschitz

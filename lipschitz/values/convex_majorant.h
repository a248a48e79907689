/// @file A ReLU network above a function of a sum that is convex in the sum.
#pragma once

#include <Eigen/Core>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// A network of one output, r(n phi(x)) for x of a box, where r is convex and r(s) >= direction rho(s) for every s.
/// What n neighbours give is then bounded by one alone:
///   direction rho(sum_j phi(x_j)) <= r(mean_j n phi(x_j)) <= max_j r(n phi(x_j)),   j = 1 .. n.
///
/// Each neuron z of rho has a convex function U above it and a convex one -L above -z. Where relu(z) counts positively,
/// relu(U) is above it, convex since relu is and does not fall; where it counts negatively, -relu(z) <= -below z <=
/// -below L, with `below` 0 or 1. U and L follow layer by layer. r is direction rho itself at every s where each neuron
/// is on if its `below` is 1, and off if it is 0: at `touched`.
///
/// L, which passes layers without a ReLU, is shifted so far that it is positive on the box. Rounding of shifts and of
/// n W goes into bias_radius.
/// @param phi its last layer has no ReLU.
/// @param direction 1 or -1 for one output, 0 for the others.
/// @param touched [outputs of phi], a sum where r should be tight.
ReachNetwork convex_majorant(const ReachNetwork& phi, const Box& box, int n, const ReachNetwork& rho,
                             const Eigen::RowVectorXd& direction, const Eigen::VectorXd& touched);

}  // namespace swarmcert::lipschitz

/// @file Keeps the joint Lipschitz bounds of a deep set below a limit during training.
///
/// gamma limits the product of the layers' norms, and thereby the joint bound, but the joint bound is an order of
/// magnitude smaller than this limit, and networks with the same gamma differ in it by a factor of two. The functions
/// below limit the joint bound itself.
#pragma once

#include <string>
#include <vector>

#include "nn/training/bounded_layers.h"

namespace swarmcert::learning {

/// A proved bound of rho(phi(x) + h) with respect to x, for any h, in output unit per unit of input.
struct JointBound {
  int phi, rho;  ///< parts of the layout
  double upper;  ///< LipSDP-Neuron or the product of the layers' norms, whichever is smaller
};

/// Returns the bounds for all pairs of a phi, including that of the ground, and a rho.
std::vector<JointBound> joint_bounds(const training::Layout& layout, const training::Vector& theta, int jobs);

/// Returns the factors on gamma's limits, per part, for which the product of the layers' limits over each phi and
/// rho, minus the slack of the kind of layers (slack_of_product()), equals `limit`; one where gamma alone keeps it.
/// Training starts from these.
std::vector<double> shares_of_product(double limit, training::Layers layers,
                                      const files::GammaStatement& gamma, const training::Layout& layout);

/// Result of one evaluation of the bounds.
struct Tightening {
  double largest = 0;  ///< the largest bound
  std::vector<double>
      shares;  ///< per part: factor on the limits of its layers that brings the bound to the limit
};

/// Scales the last weights of each rho, and with them the differences of the outputs, so that its bounds keep the
/// limit up to rounding. Bounds grow with the product of the norms over the layers of phi and rho, so the factors are
/// (limit / bound)^(1 / layers) for the largest bound in which the part is involved; they exceed one if there is room.
Tightening scale_to(double limit, const training::Layout& layout, int jobs, training::Vector& theta);

/// Scales until every bound is proved to keep the limit.
/// @throws std::runtime_error if a few attempts are not enough.
void limit_joint_bounds(double limit, const training::Layout& layout, int jobs, training::Vector& theta);

}  // namespace swarmcert::learning

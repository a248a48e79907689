/// @file Keeps the joint Lipschitz bounds of a deep set below a limit while it is trained.
///
/// gamma limits the product of the layers' norms, and with it the joint bound, but by an order of magnitude more than
/// need be: networks with the same gamma differ in their joint bounds by a factor of two. Here the joint bound itself
/// is what is limited.
#pragma once

#include <string>
#include <vector>

#include "nn/training/bounded_layers.h"

namespace swarmcert::learning {

/// A proved bound of rho(phi(x) + h) over x, for any h, in output unit per unit of input.
struct JointBound {
  int phi, rho;  ///< parts of the layout
  double upper;  ///< LipSDP-Neuron or the product of the layers' norms, whichever is smaller
};

/// All pairs of a phi, that of the ground among them, and a rho.
/// @param invariants whether phi sees invariants of the inputs (nn/invariants.h), whose map's slope is in the bounds.
std::vector<JointBound> joint_bounds(const training::Layout& layout, const training::Vector& theta, int jobs,
                                     bool invariants = false);

/// Shares of gamma's limits, per part, for which the product of the layers' limits over each phi and rho, less what the
/// kind of layers takes off it (slack_of_product()), is `limit`; one where gamma alone keeps it. Where training begins.
std::vector<double> shares_of_product(double limit, training::Layers layers,
                                      const files::GammaStatement& gamma, const training::Layout& layout);

/// What one look at the bounds asks for.
struct Tightening {
  double largest = 0;  ///< of the bounds
  std::vector<double>
      shares;  ///< per part: what its layers' limit is to be multiplied by to come to the limit
};

/// Scales the last weights of each rho, and with them what the network says of differences, so that its bounds keep
/// the limit up to rounding. Bounds grow with the product of the norms over the layers of phi and rho: shares are
/// (limit / bound)^(1 / layers) for the largest bound that the part has a hand in, above one where there is room.
Tightening scale_to(double limit, const training::Layout& layout, int jobs, training::Vector& theta,
                    bool invariants = false);

/// Scales until every bound is proved to keep the limit.
/// @throws std::runtime_error if that takes more than a few tries.
void limit_joint_bounds(double limit, const training::Layout& layout, int jobs, training::Vector& theta,
                        bool invariants = false);

}  // namespace swarmcert::learning

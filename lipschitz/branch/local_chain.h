/// @file The function of a local bound, in the form shared by all nodes of its search.
#pragma once

#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/branch/conflicts.h"
#include "lipschitz/checker/tree_proof.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// State of a neuron over a box.
enum class NeuronState : char { kOff, kOn, kUndecided };

/// The function f = g(h_K-1) with hidden layers h_k = relu(W_k h_k-1 + b_k), or h_k = W_k h_k-1 + b_k for a layer
/// without ReLU, and |g(z) - g(z')|^2 <= (z - z')' G (z - z') for all z, z'. For a plain network G = W_K' W_K; for phi
/// in front of rho, G contains a bound on rho (RhoForm).
///
/// All layers are scaled by powers of two, which commute with ReLU, so that (rho, t) are of order one: the h_k of the
/// chain is the network's h_k times 2^-exponents[k].
struct LocalChain {
  ReachNetwork hidden;                     ///< W_1 .. W_K-1, the last one with ReLU
  Eigen::MatrixXd gram;                    ///< G, rounded to nearest
  std::vector<Eigen::Index> without_relu;  ///< per hidden layer: how many of its last outputs have no ReLU
  std::vector<int> block;                  ///< coordinates of x that move; the box bounds all coordinates
  std::vector<double> weight;              ///< per moving coordinate: |dx|^2 = sum (dx_k / weight_k)^2
  std::vector<int>
      exponents;  ///< per hidden layer: e_1 + ... + e_k of the scaling; `output_exponent` for the output
  int output_exponent = 0;

  Eigen::Index inputs() const { return hidden.front().weights.cols(); }
  Eigen::Index neurons() const;  ///< number of outputs of hidden layers, including those without ReLU
  /// Conversions between rho and multipliers of layer `layer` in the units of the chain (scaled) and of the network.
  double unscaled_rho(double rho) const;
  double unscaled_multiplier(double t, std::size_t layer) const;
  double scaled_multiplier(double t, std::size_t layer) const;
  /// Returns the layer of a neuron.
  std::size_t layer_of(Eigen::Index neuron) const;
  /// Returns a pair and its multiplier in the units of the network.
  check::Conflict unscaled(const NeuronPair& pair, double multiplier) const;

  /// Returns the largest |df|^2 / |dx|^2 over all directions at x [inputs], in the units of this chain's rho: an
  /// estimate of a lower bound.
  double squared_slope(const Eigen::VectorXd& x) const;
};

/// Builds the chain of a network.
/// @param layers the network's layers in double, the last one without ReLU, the one before with ReLU.
/// @param form   the Gram matrix of the function behind the last layer, [outputs x outputs]; empty: the identity.
LocalChain local_chain(const ReachNetwork& layers, const Eigen::MatrixXd& form, const std::vector<int>& block,
                       const std::vector<double>& weight);

/// Returns the hidden layers on the moving inputs: a neuron that is off has dz = 0, one that is on has dz = dy.
std::vector<SlopeLayer> slope_layers(const LocalChain& chain, const std::vector<NeuronState>& states);

/// The chain of a set function, split at the last layer of phi, v = W h + b, which has no ReLU: the hidden layers of
/// phi, whose `gram` is set later from a form Q with |drho|^2 <= dv' Q dv, and rho as a function of v. All parts are in
/// the units of the whole chain.
struct SetChain {
  LocalChain whole, phi, rho;
  Eigen::MatrixXd last;  ///< W

  /// Returns G of phi for a form Q.
  Eigen::MatrixXd gram(const Eigen::MatrixXd& q) const { return last.transpose() * q * last; }
  /// Returns the exponent of the power of two that converts a form of the chain into one of the network.
  int form_exponent() const;
};

/// Splits the chain of a set function.
/// @param last index of phi's last layer among the hidden layers of `whole`.
SetChain set_chain(const LocalChain& whole, std::size_t last);

/// Returns the chain as a function of (u, s); see check::homogeneous().
LocalChain homogeneous(LocalChain chain);

}  // namespace swarmcert::lipschitz

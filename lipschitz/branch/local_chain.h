/// @file The function of a local bound, in the form that all nodes of its search share.
#pragma once

#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/branch/conflicts.h"
#include "lipschitz/checker/tree_proof.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// f = g(h_K-1), with the hidden layers h_k = relu(W_k h_k-1 + b_k), or without a ReLU where the layer has none, and
/// |g(z) - g(z')|^2 <= (z - z')' G (z - z') for all z, z'. Of a plain network G = W_K' W_K; for phi in front of rho it
/// carries a bound on rho (RhoBound).
///
/// Everything is scaled by powers of two per layer, which ReLU lets through, so that (rho, t) are of order one:
/// h_k here is 2^-scale[k] times the network's.
struct LocalChain {
  ReachNetwork hidden;                     ///< W_1 .. W_K-1, the last one with ReLU
  Eigen::MatrixXd gram;                    ///< G, rounded to nearest: a search proposes, the checker verifies
  std::vector<Eigen::Index> without_relu;  ///< per hidden layer: the last so many outputs pass as they are
  std::vector<int> block;                  ///< coordinates of x that move; the box bounds all
  std::vector<double> weight;              ///< per moving coordinate: |dx|^2 = sum (dx_k / weight_k)^2
  std::vector<int>
      exponents;  ///< per hidden layer: e_1 + ... + e_k of the scaling; the output's is `output_exponent`
  int output_exponent = 0;

  Eigen::Index inputs() const { return hidden.front().weights.cols(); }
  Eigen::Index neurons() const;  ///< outputs of hidden layers, those without ReLU included
  /// rho of the network for rho here, and the other way round for multipliers of layer k.
  double unscaled_rho(double rho) const;
  double unscaled_multiplier(double t, std::size_t layer) const;
  double scaled_multiplier(double t, std::size_t layer) const;
  /// The layer of the n-th neuron.
  std::size_t layer_of(Eigen::Index neuron) const;
  /// A pair and its multiplier for the network.
  check::Conflict unscaled(const NeuronPair& pair, double multiplier) const;

  /// |df|^2 per |dx|^2 in the steepest direction at x [inputs], in the units of `rho` here: an estimate from below.
  double squared_slope(const Eigen::VectorXd& x) const;
};

/// @param layers the network's layers in double, the last one without ReLU, the one before with ReLU.
/// @param form   the Gram matrix of what follows the last layer, [outputs x outputs]; empty: the identity.
LocalChain local_chain(const ReachNetwork& layers, const Eigen::MatrixXd& form, const std::vector<int>& block,
                       const std::vector<double>& weight);

/// A set function's chain, taken apart at phi's last layer v = W h + b, which has no ReLU: phi's hidden layers, whose
/// `gram` waits for a form Q with |drho|^2 <= dv' Q dv, and rho as a function of v. All in the units of the whole.
struct SetChain {
  LocalChain whole, phi, rho;
  Eigen::MatrixXd last;  ///< W

  /// G of phi for a form.
  Eigen::MatrixXd gram(const Eigen::MatrixXd& q) const { return last.transpose() * q * last; }
  /// Exponent of the power of two that turns a form of the chain into the network's.
  int form_exponent() const;
};

/// @param last index of phi's last layer among the hidden layers of `whole`.
SetChain set_chain(const LocalChain& whole, std::size_t last);

/// The chain as a function of (u, s): see check::homogeneous().
LocalChain homogeneous(LocalChain chain);

}  // namespace swarmcert::lipschitz

/// @file A structured primal-dual interior-point method for LipSDP-Neuron. The result is not trusted: the checker
/// verifies it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/base/stop.h"
#include "lipschitz/checker/bounds.h"
#include "lipschitz/solver/interior_point.h"

namespace swarmcert::lipschitz {

/// A ReLU chain f = M_K relu(... relu(M_1 x + b_1) ...) + b_K without its biases, which do not affect a global bound.
/// M_k is [n_k x n_{k-1}].
using ReluChain = std::vector<Eigen::MatrixXd>;

/// Returns e_1 .. e_K such that the chain M_k 2^-e_k has (rho, t) of order one; see scale() in lipsdp_solver.cpp.
std::vector<int> balancing_exponents(const ReluChain& chain);

/// A feasible point of the semidefinite program, up to rounding: S(rho, t) > 0 held in floating point.
struct LipSdpPoint {
  double rho = 0;           ///< bound on the squared Lipschitz constant
  Eigen::VectorXd t;        ///< one multiplier per hidden neuron, first layer first
  double relative_gap = 0;  ///< (rho - dual objective) / rho, or infinity before the dual is feasible
};

struct LipSdpOptions {
  double relative_gap = 2e-8;  ///< stop when the relative distance of rho to the optimum is below this
  int max_iterations = 80;
  Stop stop;  ///< checked several times per iteration
};

struct LipSdpResult {
  LipSdpStop stop = LipSdpStop::kNothingRun;
  int iterations = 0;
  /// Strictly feasible points, best last; empty only after a stop before the first one.
  std::vector<LipSdpPoint> points;
  /// The optimum of the program lies between these, up to round-off.
  Estimate optimum_lower{0};
  Estimate optimum_upper{0};
};

/// Minimises rho over (rho, t) subject to S(rho, t) >= 0, where (Fazlyab et al. 2019)
///   S = rho diag(I, 0) - blockdiag(0, M_K' M_K) - sum_i t_i (a_i e_i' + e_i a_i'),
/// in the variables (x, z_1, ..., z_{K-1}); e_i selects neuron i and a_i = (its row of M_k in the columns of
/// z_{k-1}) - e_i. sqrt(rho) bounds the Lipschitz constant of the chain.
///
/// Solved by minimise() of interior_point.h; chains of more than 300 neurons by minimise_chain() of chain_newton.h. The
/// layers are first scaled by powers of two, and wide inputs (n_0 > n_1) are reduced to n_1 by a QR factorisation of
/// M_1'.
///
/// @param chain at least two matrices (one hidden layer), finite entries, matching sizes.
/// @returns points in the original scale of the chain: floating-point estimates without a guarantee; verify them.
LipSdpResult solve_lipsdp(const ReluChain& chain, const LipSdpOptions& options = {});

}  // namespace swarmcert::lipschitz

#include "lipschitz/eclipse_fast.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "lipschitz/dense_kernels.h"
#include "lipschitz/live_chain.h"
#include "lipschitz/sdp_bound.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// tau_1 .. tau_{K-1} and rho of a chain of order one.
struct LayerMultipliers {
  std::vector<double> tau;
  double rho = 0;
};

LayerMultipliers layer_multipliers(const ReluChain& chain) {
  LayerMultipliers result;
  MatrixXd x = MatrixXd::Identity(chain[0].cols(), chain[0].cols());
  for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
    const MatrixXd through = chain[k] * x.llt().solve(chain[k].transpose());
    const double tau = 1 / largest_eigenvalue(through);
    result.tau.push_back(tau);
    x = 2 * tau * MatrixXd::Identity(through.rows(), through.rows()) - tau * tau * through;
  }
  result.rho = largest_eigenvalue(chain.back() * x.llt().solve(chain.back().transpose()));
  return result;
}

}  // namespace

std::optional<UpperProof> eclipse_fast(const std::vector<check::Matrix>& stages) {
  if (stages.size() == 1) return sdp_bound(stages).proof;
  const LiveChain live(stages);
  if (live.is_constant())
    return prove(stages, std::numeric_limits<double>::min(), live.multipliers(VectorXd()));

  // In units in which the layers are of order one: products of many layers leave the range of double.
  ReluChain chain = live.live();
  const std::vector<int> exponents = balancing_exponents(chain);
  int total = 0;
  Index neurons = 0;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    chain[k] *= std::ldexp(1.0, -exponents[k]);
    total += exponents[k];
    neurons += k + 1 < chain.size() ? chain[k].rows() : 0;
  }
  const LayerMultipliers found = layer_multipliers(chain);
  if (!(found.rho > 0) || !std::isfinite(found.rho)) return std::nullopt;
  VectorXd t(neurons);
  int up_to = 0;
  Index next = 0;
  for (std::size_t k = 0; k < found.tau.size(); ++k) {
    up_to += exponents[k];
    t.segment(next, chain[k].rows()).setConstant(std::ldexp(found.rho * found.tau[k], 2 * (total - up_to)));
    next += chain[k].rows();
  }
  for (const double slack : {1e-12, 1e-10, 1e-8, 1e-6}) {
    std::optional<UpperProof> proof =
        prove(stages, std::ldexp(found.rho * (1 + slack), 2 * total), live.multipliers((1 + slack) * t));
    if (proof) return proof;
  }
  return std::nullopt;
}

}  // namespace swarmcert::lipschitz

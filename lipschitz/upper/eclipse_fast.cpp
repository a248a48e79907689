#include "lipschitz/upper/eclipse_fast.h"

#include <cmath>
#include <limits>

#include "lipschitz/solver/chain_slack.h"
#include "lipschitz/solver/dense_kernels.h"
#include "lipschitz/upper/live_chain.h"
#include "lipschitz/upper/sdp_bound.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// tau_1 .. tau_{K-1} and rho of a chain whose layers are of order one.
struct LayerMultipliers {
  std::vector<double> tau;
  double rho = 0;
};

LayerMultipliers layer_multipliers(const ReluChain& chain) {
  LayerMultipliers result;
  MatrixXd gram = MatrixXd::Zero(chain[0].rows(), chain[0].rows());
  add_lower_gram(gram, 1, chain[0]);
  for (std::size_t k = 1; k < chain.size(); ++k) {
    result.tau.push_back(1 / largest_eigenvalue(gram));
    gram = layerwise_gram(chain[k], gram, result.tau.back());
    if (gram.size() == 0) return result;  // impossible: the least eigenvalue of the inverted matrix is tau
  }
  result.rho = largest_eigenvalue(gram);
  return result;
}

}  // namespace

std::optional<UpperProof> eclipse_fast(const std::vector<check::Matrix>& stages) {
  if (stages.size() == 1) return sdp_bound(stages).proof;
  use_one_blas_thread();
  const LiveChain live(stages);
  if (live.is_constant())
    return prove(stages, std::numeric_limits<double>::min(), live.multipliers(VectorXd()));

  // Scales the layers to order one, because products of many layers could leave the range of double.
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

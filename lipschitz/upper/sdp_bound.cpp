#include "lipschitz/upper/sdp_bound.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "lipschitz/upper/live_chain.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;

/// Bounds a chain without hidden layers, whose Lipschitz constant is the norm of its matrix.
SdpBound linear_bound(const std::vector<check::Matrix>& stages, const MatrixXd& m) {
  SdpBound result;
  const MatrixXd gram = m.rows() <= m.cols() ? MatrixXd(m * m.transpose()) : MatrixXd(m.transpose() * m);
  const double rho = std::max(
      0.0, Eigen::SelfAdjointEigenSolver<MatrixXd>(gram, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
  result.optimum = Estimate(std::sqrt(rho));
  result.stop = LipSdpStop::kGapReached;
  for (double slack = 1e-14; slack < 1 && !result.proof; slack *= 4) {
    result.proof = prove(stages, std::max(rho * (1 + slack), std::numeric_limits<double>::min()), {});
  }
  return result;
}

}  // namespace

SdpBound sdp_bound(const std::vector<check::Matrix>& stages, const SdpOptions& options) {
  if (stages.size() == 1) return linear_bound(stages, rounded(stages).front());

  SdpBound result;
  const LiveChain chain(stages);
  if (chain.is_constant()) {  // the smallest positive rho is a bound
    result.stop = LipSdpStop::kGapReached;
    result.proof = prove(stages, std::numeric_limits<double>::min(), chain.multipliers(Eigen::VectorXd()));
    return result;
  }
  LipSdpOptions solver;
  solver.stop = options.stop;
  solver.relative_gap = options.relative_gap;
  const LipSdpResult solved = solve_lipsdp(chain.live(), solver);
  result.stop = solved.stop;
  result.iterations = solved.iterations;
  result.optimum = solved.optimum_upper;
  for (auto point = solved.points.rbegin(); point != solved.points.rend() && !result.proof; ++point) {
    if (is_interrupted(solved.stop) && options.known &&
        !(point->rho < options.known->value() * options.known->value()))
      break;
    const std::vector<double> t = chain.multipliers(point->t);
    for (const double slack : {0.0, 1e-9, 1e-8}) {
      result.proof = prove(stages, point->rho * (1 + slack), t);
      if (result.proof) break;
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz

#include "lipschitz/solver/lipsdp_solver.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "lipschitz/solver/chain_newton.h"
#include "lipschitz/solver/chain_slack.h"
#include "lipschitz/solver/dense_kernels.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The chain scaled by a power of two per stage, and the layout of its blocks.
struct ScaledProblem {
  std::vector<MatrixXd> stages;
  std::vector<int> exponents;  ///< stages[k] = chain[k] * 2^-exponents[k]
  std::vector<Index> begin;    ///< first index of block k in (x, z_1, ..., z_{K-1}); back() is the size
  Index size() const { return begin.back(); }
  Index inputs() const { return begin[1]; }
  Index neurons() const { return size() - inputs(); }
  std::size_t layers() const { return stages.size() - 1; }  ///< number of hidden layers
};

/// Returns the exponent of the power of two nearest to x > 0; 0 for x = 0.
int nearest_exponent(double x) {
  return x > 0 && std::isfinite(x) ? static_cast<int>(std::lround(std::log2(x))) : 0;
}

/// Scales layer by layer such that rho = 1 and all t = 1 is nearly optimal among multipliers that are equal within a
/// layer: t_k = 1 / lambda_max(M_k X_{k-1}^-1 M_k') with X_k = 2 t_k I - t_k^2 M_k X_{k-1}^-1 M_k' >= t_k I
/// (layerwise_gram()). The blocks of S are then of order one, and 2 (rho, t) is well inside the feasible set.
ScaledProblem scale(const ReluChain& chain) {
  ScaledProblem problem;
  problem.stages = chain;
  MatrixXd& first = problem.stages.front();
  if (first.cols() >
      first.rows()) {  // |M_1 x| = |R' Q' x|: an orthogonal change of inputs drops the null space
    const Eigen::HouseholderQR<MatrixXd> qr(first.transpose());
    const MatrixXd r = qr.matrixQR().topRows(first.rows()).triangularView<Eigen::Upper>();
    first = r.transpose();
  }
  problem.begin = {0, first.cols()};
  MatrixXd g = MatrixXd::Zero(first.rows(), first.rows());
  add_lower_gram(g, 1, first);
  int unit_before = 0;  // z_{k-1} is in units of 2^unit_before
  for (std::size_t k = 0; k < problem.stages.size(); ++k) {
    MatrixXd& m = problem.stages[k];
    problem.begin.push_back(problem.begin.back() + m.rows());
    const double largest = largest_eigenvalue(g);
    const int unit = largest > 0 ? nearest_exponent(std::sqrt(largest)) : unit_before;
    problem.exponents.push_back(unit - unit_before);
    m *= std::ldexp(1.0, unit_before - unit);
    unit_before = unit;
    const double t = largest > 0 ? 1 / largest : std::ldexp(1.0, -2 * unit);  // no input: fixes the units
    if (k + 1 == problem.stages.size()) break;
    g = layerwise_gram(problem.stages[k + 1], g, t);
    if (g.size() == 0) g = MatrixXd::Zero(problem.stages[k + 1].rows(), problem.stages[k + 1].rows());
  }
  problem.begin.pop_back();  // the output is not a variable
  return problem;
}

/// S(rho, t) of a chain: block tridiagonal.
class ChainInequality final : public RankTwoInequality {
 public:
  explicit ChainInequality(const ScaledProblem& problem) : p_(problem) {
    const MatrixXd& last = p_.stages.back();
    last_gram_ = last.transpose() * last;
  }

  Index size() const override { return p_.size(); }
  Index inputs() const override { return p_.inputs(); }
  std::vector<Index> slack_blocks() const override { return p_.begin; }

  MatrixXd linear(const VectorXd& y) const override {
    MatrixXd s = MatrixXd::Zero(p_.size(), p_.size());
    s.topLeftCorner(p_.inputs(), p_.inputs()).diagonal().setConstant(y(0));
    const auto t = y.tail(p_.neurons());
    s.diagonal().tail(p_.neurons()) = 2.0 * t;
    for (std::size_t k = 0; k < p_.layers(); ++k) {
      const MatrixXd& m = p_.stages[k];
      const auto t_k = t.segment(p_.begin[k + 1] - p_.inputs(), m.rows());
      s.block(p_.begin[k + 1], p_.begin[k], m.rows(), m.cols()) = -(t_k.asDiagonal() * m);
      s.block(p_.begin[k], p_.begin[k + 1], m.cols(), m.rows()) =
          s.block(p_.begin[k + 1], p_.begin[k], m.rows(), m.cols()).transpose();
    }
    return s;
  }

  MatrixXd slack(const VectorXd& y) const override {
    MatrixXd s = linear(y);
    s.bottomRightCorner(last_gram_.rows(), last_gram_.rows()) -= last_gram_;
    return s;
  }

  MatrixXd times_a(const MatrixXd& x) const override {
    MatrixXd result = -x.rightCols(p_.neurons());
    for (std::size_t k = 0; k < p_.layers(); ++k) {
      const MatrixXd& m = p_.stages[k];
      add_product_transposed(result.middleCols(p_.begin[k + 1] - p_.inputs(), m.rows()),
                             x.middleCols(p_.begin[k], m.cols()), m);
    }
    return result;
  }

  MatrixXd a_transposed_times(const MatrixXd& x) const override {
    MatrixXd result = -x.bottomRows(p_.neurons());
    for (std::size_t k = 0; k < p_.layers(); ++k) {
      const MatrixXd& m = p_.stages[k];
      add_product(result.middleRows(p_.begin[k + 1] - p_.inputs(), m.rows()), m,
                  x.middleRows(p_.begin[k], m.cols()));
    }
    return result;
  }

  MatrixXd times_patterned(const MatrixXd& x, const MatrixXd& d) const override {
    MatrixXd result = MatrixXd::Zero(x.rows(), x.cols());
    const std::size_t blocks = p_.begin.size() - 1;
    for (std::size_t k = 0; k < blocks; ++k) {
      const Index from = p_.begin[k == 0 ? 0 : k - 1];
      const Index to = p_.begin[std::min(k + 2, blocks)];
      const Index width = p_.begin[k + 1] - p_.begin[k];
      add_product(result.middleCols(p_.begin[k], width), x.middleCols(from, to - from),
                  d.block(from, p_.begin[k], to - from, width));
    }
    return result;
  }

 private:
  const ScaledProblem& p_;
  MatrixXd last_gram_;
};

InteriorPointResult minimise(const ScaledProblem& problem, const LipSdpOptions& options) {
  InteriorPointOptions inner;
  inner.relative_gap = options.relative_gap;
  inner.max_iterations = options.max_iterations;
  inner.stop = options.stop;
  if (std::optional<InteriorPointResult> found = minimise_long_chain(ChainSlack(problem.stages), inner))
    return *std::move(found);
  const ChainInequality inequality(problem);

  // The vector of ones is nearly feasible, up to the rounding to powers of two. Scaling (rho, t) up moves it inside the
  // cone.
  const auto scaled_up = [&problem](double shrink) {
    VectorXd y(1 + problem.neurons());
    double level = 4;
    for (std::size_t k = problem.layers(); k-- > 0; level /= shrink)
      y.segment(1 + problem.begin[k + 1] - problem.inputs(), problem.stages[k].rows()).setConstant(level);
    y(0) = level;
    return y;
  };
  double shrink = 0.5;
  while (!options.stop.now() && cholesky(inequality.slack(scaled_up(shrink))).size() == 0) shrink *= 0.5;

  return minimise(inequality, scaled_up(shrink), inner);
}

}  // namespace

std::vector<int> balancing_exponents(const ReluChain& chain) { return scale(chain).exponents; }

LipSdpResult solve_lipsdp(const ReluChain& chain, const LipSdpOptions& options) {
  use_one_blas_thread();
  const ScaledProblem problem = scale(chain);
  const InteriorPointResult found = minimise(problem, options);

  // z_k of the scaled chain is z_k of the chain over 2^(e_1 + ... + e_k), and its output over 2^(sum of all e).
  int total = 0;
  for (const int e : problem.exponents) total += e;
  LipSdpResult result;
  result.stop = found.stop;
  result.iterations = found.iterations;
  for (std::size_t p = 0; p < found.points.size(); ++p) {
    const VectorXd& y = found.points[p];
    LipSdpPoint point;
    point.relative_gap = found.gaps[p];
    point.rho = std::ldexp(y(0), 2 * total);
    point.t.resize(problem.neurons());
    int up_to = 0;
    for (std::size_t k = 0; k < problem.layers(); ++k) {
      up_to += problem.exponents[k];
      const Index from = problem.begin[k + 1] - problem.inputs();
      for (Index i = 0; i < problem.stages[k].rows(); ++i)
        point.t(from + i) = std::ldexp(y(1 + from + i), 2 * (total - up_to));
    }
    result.points.push_back(std::move(point));
  }
  if (result.points.empty()) return result;  // stopped before the first one
  result.optimum_upper = Estimate(std::sqrt(result.points.back().rho));
  result.optimum_lower = Estimate(std::sqrt(std::ldexp(std::max(found.best_dual, 0.0), 2 * total)));
  return result;
}

}  // namespace swarmcert::lipschitz

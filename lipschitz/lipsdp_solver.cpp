#include "lipschitz/lipsdp_solver.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "lipschitz/dense_kernels.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Step lengths come from Lanczos, which can miss the least eigenvalue: shorten until Cholesky agrees.
constexpr double kBacktrack = 0.8;
/// Relative accuracy of that eigenvalue: for the centring parameter, which is a heuristic, and for the step.
constexpr double kRough = 0.1, kFine = 0.02;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The chain scaled by a power of two per stage, and where each block lies.
struct ScaledProblem {
  std::vector<MatrixXd> stages;
  std::vector<int> exponents;  ///< stages[k] = chain[k] * 2^-exponents[k]
  std::vector<Index> begin;    ///< first index of block k in (x, z_1, ..., z_{K-1}); back() is the size
  Index size() const { return begin.back(); }
  Index inputs() const { return begin[1]; }
  Index neurons() const { return size() - inputs(); }
  std::size_t layers() const { return stages.size() - 1; }  ///< hidden layers
};

/// Largest eigenvalue of a symmetric positive semidefinite matrix.
double largest_eigenvalue(const MatrixXd& m) {
  return std::max(
      0.0, Eigen::SelfAdjointEigenSolver<MatrixXd>(m, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

/// The power of two next to x > 0; 1 for x = 0.
int nearest_exponent(double x) {
  return x > 0 && std::isfinite(x) ? static_cast<int>(std::lround(std::log2(x))) : 0;
}

/// Scales layer by layer so that rho = 1 and all t = 1 is nearly optimal among multipliers that are equal within a
/// layer: t_k = 1 / lambda_max(M_k X_{k-1}^-1 M_k') with X_k = 2 t_k I - t_k^2 M_k X_{k-1}^-1 M_k' >= t_k I
/// (the recursion of Xu and Sivaranjani 2024). Blocks of S are then of order one, and 2 (rho, t) is well inside.
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
  MatrixXd x_inverse = MatrixXd::Identity(first.cols(), first.cols());
  int unit_before = 0;  // z_{k-1} is measured in units of 2^unit_before
  for (std::size_t k = 0; k < problem.stages.size(); ++k) {
    MatrixXd& m = problem.stages[k];
    problem.begin.push_back(problem.begin.back() + m.rows());
    const MatrixXd g = m * x_inverse * m.transpose();
    const double largest = largest_eigenvalue(g);
    const int unit = largest > 0 ? nearest_exponent(std::sqrt(largest)) : unit_before;
    problem.exponents.push_back(unit - unit_before);
    m *= std::ldexp(1.0, unit_before - unit);
    unit_before = unit;
    const double t = largest > 0 ? 1 / largest : 1.0;
    x_inverse = (2 * t * MatrixXd::Identity(m.rows(), m.rows()) - t * t * g).inverse();
  }
  problem.begin.pop_back();  // the output is no variable
  return problem;
}

/// Everything the iteration needs of S(y), y = (rho, t).
class Iteration {
 public:
  explicit Iteration(const ScaledProblem& problem) : p_(problem) {
    const MatrixXd& last = p_.stages.back();
    last_gram_ = last.transpose() * last;
  }

  /// Sum_j y_j A_j: with the constant term this is S.
  MatrixXd linear(const VectorXd& y) const {
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

  MatrixXd slack(const VectorXd& y) const {
    MatrixXd s = linear(y);
    s.bottomRightCorner(last_gram_.rows(), last_gram_.rows()) -= last_gram_;
    return s;
  }

  /// X A, where column i of A is a_i; X is [rows x size].
  MatrixXd times_a(const MatrixXd& x) const {
    MatrixXd result = -x.rightCols(p_.neurons());
    for (std::size_t k = 0; k < p_.layers(); ++k) {
      const MatrixXd& m = p_.stages[k];
      add_product_transposed(result.middleCols(p_.begin[k + 1] - p_.inputs(), m.rows()),
                             x.middleCols(p_.begin[k], m.cols()), m);
    }
    return result;
  }

  /// A' X.
  MatrixXd a_transposed_times(const MatrixXd& x) const {
    MatrixXd result = -x.bottomRows(p_.neurons());
    for (std::size_t k = 0; k < p_.layers(); ++k) {
      const MatrixXd& m = p_.stages[k];
      add_product(result.middleRows(p_.begin[k + 1] - p_.inputs(), m.rows()), m,
                  x.middleRows(p_.begin[k], m.cols()));
    }
    return result;
  }

  /// X D for D with the pattern of S: block tridiagonal.
  MatrixXd times_banded(const MatrixXd& x, const MatrixXd& d) const {
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

  /// (<A_j, X>)_j for symmetric X, given X A.
  VectorXd functionals(const MatrixXd& x, const MatrixXd& x_a) const {
    VectorXd v(1 + p_.neurons());
    v(0) = x.diagonal().head(p_.inputs()).sum();
    v.tail(p_.neurons()) = -2.0 * x_a.bottomRows(p_.neurons()).diagonal();
    return v;
  }

  const ScaledProblem& problem() const { return p_; }

 private:
  const ScaledProblem& p_;
  MatrixXd last_gram_;
};

/// Largest alpha <= 1 with X + alpha D >= 0 kept at a distance, from the least eigenvalue of L^-1 D L^-T by Lanczos
/// with full reorthogonalisation, stopped at a relative accuracy. `factor` is L with X = L L'.
double step_length(const MatrixXd& factor, const MatrixXd& direction, double fraction, double accuracy) {
  const Index n = direction.rows();
  const int steps = static_cast<int>(std::min<Index>(n, 30));
  MatrixXd basis(n, steps + 1);
  VectorXd alpha(steps), beta(steps);
  basis.col(0) = VectorXd::LinSpaced(n, 1.0, 1.7).normalized();
  double least = 0;
  for (int k = 0; k < steps; ++k) {
    VectorXd w = congruence_times(factor, direction, basis.col(k));
    alpha(k) = basis.col(k).dot(w);
    w -= basis.leftCols(k + 1) * (basis.leftCols(k + 1).transpose() * w);
    w -= basis.leftCols(k + 1) * (basis.leftCols(k + 1).transpose() * w);
    beta(k) = w.norm();
    const bool last = k + 1 == steps || beta(k) < 1e-12;
    if (last || k % 5 == 4) {
      Eigen::SelfAdjointEigenSolver<MatrixXd> eigen;
      eigen.computeFromTridiagonal(alpha.head(k + 1), beta.head(k), Eigen::ComputeEigenvectors);
      const double residual = std::abs(beta(k) * eigen.eigenvectors()(k, 0));
      least = eigen.eigenvalues()(0) - residual;
      if (last || residual < accuracy * std::abs(eigen.eigenvalues()(0))) break;
    }
    basis.col(k + 1) = w / beta(k);
  }
  return least < 0 ? std::min(1.0, -fraction / least) : 1.0;
}

/// Tries `step`, then shorter ones, until `factor_at(step)` succeeds; empty if none does.
template <class FactorAt>
MatrixXd backtrack(double step, const FactorAt& factor_at) {
  MatrixXd factor;
  for (int tries = 0; tries < 10 && factor.size() == 0; ++tries) {
    factor = factor_at(step);
    step *= kBacktrack;
  }
  return factor;
}

void symmetrise(MatrixXd& x) { x = 0.5 * (x + MatrixXd(x.transpose())); }

/// M_ij = <A_i, Z A_j Y>, from rank-two constraints.
MatrixXd schur_complement(const Iteration& it, const MatrixXd& z, const MatrixXd& z_a, const MatrixXd& y,
                          const MatrixXd& y_a) {
  const Index n0 = it.problem().inputs();
  const Index m = it.problem().neurons();
  const MatrixXd a_z_a = it.a_transposed_times(z_a);
  const MatrixXd a_y_a = it.a_transposed_times(y_a);
  MatrixXd schur(m + 1, m + 1);
  const auto e_z_a = z_a.bottomRows(m).array();
  const MatrixXd cross = e_z_a * y_a.bottomRows(m).transpose().array();
  schur.bottomRightCorner(m, m) = cross + cross.transpose();
  schur.bottomRightCorner(m, m).array() += z.bottomRightCorner(m, m).array() * a_y_a.array();
  schur.bottomRightCorner(m, m).array() += a_z_a.array() * y.bottomRightCorner(m, m).array();
  const VectorXd edge = -((z_a.topRows(n0).array() * y.topRightCorner(n0, m).array()).colwise().sum() +
                          (z.topRightCorner(n0, m).array() * y_a.topRows(n0).array()).colwise().sum())
                             .transpose();
  schur.col(0).tail(m) = edge;
  schur.row(0).tail(m) = edge.transpose();
  schur(0, 0) = (z.topLeftCorner(n0, n0).array() * y.topLeftCorner(n0, n0).array()).sum();
  return schur;
}

/// Solves M v = rhs for a symmetric positive definite M that may be badly scaled.
class SchurSolver {
 public:
  explicit SchurSolver(const MatrixXd& schur) : scale_(schur.diagonal().cwiseSqrt().cwiseInverse()) {
    scaled_ = scale_.asDiagonal() * schur * scale_.asDiagonal();
    for (double regularisation = 1e-15; regularisation < 1e-6; regularisation *= 100) {
      MatrixXd shifted = scaled_;
      shifted.diagonal().array() += regularisation;
      factor_ = cholesky(shifted);
      if (factor_.size() > 0) break;
    }
  }
  bool good() const { return factor_.size() > 0 && scale_.allFinite(); }
  VectorXd solve(const VectorXd& rhs) const {
    const VectorXd b = scale_.cwiseProduct(rhs);
    VectorXd v = b;
    solve_cholesky(factor_, v);
    for (int i = 0; i < 2; ++i) {  // undoes the regularisation
      VectorXd residual = b;
      add_symmetric_product(residual, -1.0, scaled_, v);
      solve_cholesky(factor_, residual);
      v += residual;
    }
    return scale_.cwiseProduct(v);
  }

 private:
  VectorXd scale_;
  MatrixXd scaled_;
  MatrixXd factor_;
};

}  // namespace

const char* name(LipSdpStop stop) {
  switch (stop) {
    case LipSdpStop::kGapReached:
      return "gap reached";
    case LipSdpStop::kIterationLimit:
      return "iteration limit";
    case LipSdpStop::kNumericalLimit:
      return "numerical limit";
    case LipSdpStop::kCancelled:
      return "cancelled";
    case LipSdpStop::kNothingRun:
      break;
  }
  return "nothing run";
}

LipSdpResult solve_lipsdp(const ReluChain& chain, const LipSdpOptions& options) {
  use_one_blas_thread();
  const ScaledProblem problem = scale(chain);
  const Iteration it(problem);
  const Index n = problem.size();
  const Index m = problem.neurons();

  // Within rounding to powers of two all-ones is feasible or nearly so; scaling (rho, t) up moves inside the cone.
  VectorXd y = VectorXd::Ones(m + 1);
  MatrixXd s, s_factor;
  for (double shrink = 0.5; s_factor.size() == 0; shrink *= 0.5) {
    y.setOnes();
    double level = 4;
    for (std::size_t k = problem.layers(); k-- > 0; level /= shrink) {
      y.segment(1 + problem.begin[k + 1] - problem.inputs(), problem.stages[k].rows()).setConstant(level);
    }
    y(0) = level;
    s = it.slack(y);
    s_factor = cholesky(s);
  }
  // Z = mu S^-1 with trace 1 over the inputs: on the central path but for the constraints of the neurons.
  MatrixXd z = inverse_from_cholesky(s_factor);
  const double trace = z.diagonal().head(problem.inputs()).sum();
  z /= trace;
  MatrixXd z_factor = cholesky(z);

  // z_k of the scaled chain is z_k of the chain over 2^(e_1 + ... + e_k), and its output over 2^(sum of all e).
  int total = 0;
  for (const int e : problem.exponents) total += e;
  const auto unscaled = [&](double gap) {
    LipSdpPoint point;
    point.relative_gap = gap;
    point.rho = std::ldexp(y(0), 2 * total);
    point.t.resize(m);
    int up_to = 0;
    for (std::size_t k = 0; k < problem.layers(); ++k) {
      up_to += problem.exponents[k];
      const Index from = problem.begin[k + 1] - problem.inputs();
      for (Index i = 0; i < problem.stages[k].rows(); ++i) {
        point.t(from + i) = std::ldexp(y(1 + from + i), 2 * (total - up_to));
      }
    }
    return point;
  };

  VectorXd b = VectorXd::Zero(m + 1);
  b(0) = 1;
  LipSdpResult result;
  result.points.push_back(unscaled(kInfinity));
  result.stop = LipSdpStop::kIterationLimit;
  double best_dual = 0;
  if (z_factor.size() == 0) {
    result.stop = LipSdpStop::kNumericalLimit;
    result.optimum_upper = Estimate(std::sqrt(std::ldexp(y(0), 2 * total)));
    return result;
  }
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    if (options.cancelled != nullptr && *options.cancelled) {
      result.stop = LipSdpStop::kCancelled;
      break;
    }
    const MatrixXd s_inverse = inverse_from_cholesky(s_factor);
    const MatrixXd z_a = it.times_a(z);
    const MatrixXd y_a = it.times_a(s_inverse);
    const VectorXd residual = b - it.functionals(z, z_a);
    const double mu = z.cwiseProduct(s).sum() / static_cast<double>(n);
    // Dual objective <C, Z>; with a feasible Z it is below the optimum.
    const double infeasibility = residual.cwiseAbs().maxCoeff();
    const double gap = static_cast<double>(n) * mu / y(0);
    if (infeasibility < 1e-9) best_dual = std::max(best_dual, y(0) - static_cast<double>(n) * mu);
    if (gap < options.relative_gap && infeasibility < 1e-7) {
      result.stop = LipSdpStop::kGapReached;
      break;
    }

    const SchurSolver schur(schur_complement(it, z, z_a, s_inverse, y_a));
    if (!schur.good()) {
      result.stop = LipSdpStop::kNumericalLimit;
      break;
    }
    const VectorXd inverse_functionals = it.functionals(s_inverse, y_a);

    // Predictor.
    const VectorXd dy_a = schur.solve(-b);
    const MatrixXd ds_a = it.linear(dy_a);
    MatrixXd dz_a = -z;
    add_product(dz_a, it.times_banded(-z, ds_a), s_inverse);
    symmetrise(dz_a);
    const double primal_a = step_length(z_factor, dz_a, 1.0, kRough);
    const double dual_a = step_length(s_factor, ds_a, 1.0, kRough);
    const double mu_a = (z + primal_a * dz_a).cwiseProduct(s + dual_a * ds_a).sum() / static_cast<double>(n);
    const double ratio = std::clamp(mu_a / mu, 0.0, 1.0);
    const double sigma = std::max(1e-6, ratio * ratio * (primal_a > 0.1 && dual_a > 0.1 ? ratio : 1.0));

    // Corrector.
    const MatrixXd q = it.times_banded(dz_a, ds_a);
    VectorXd rhs = sigma * mu * inverse_functionals - b;
    const MatrixXd a_q = it.a_transposed_times(q);
    rhs.tail(m) += (q.bottomRows(m).array() * y_a.transpose().array()).rowwise().sum().matrix() +
                   (a_q.array() * s_inverse.bottomRows(m).array()).rowwise().sum().matrix();
    rhs(0) -= (q.topRows(problem.inputs()).array() * s_inverse.topRows(problem.inputs()).array()).sum();
    const VectorXd dy = schur.solve(rhs);
    const MatrixXd ds = it.linear(dy);
    MatrixXd dz = sigma * mu * s_inverse - z;
    add_product(dz, it.times_banded(-z, ds) - q, s_inverse);
    symmetrise(dz);
    const double fraction = std::min(0.98, 0.9 + 0.09 * std::min(primal_a, dual_a));
    const double primal = step_length(z_factor, dz, fraction, kFine);
    const double dual = step_length(s_factor, ds, fraction, kFine);

    const VectorXd y_before = y;
    s_factor = backtrack(dual, [&](double step) {
      y = y_before + step * dy;
      s = it.slack(y);
      return cholesky(s);
    });
    const MatrixXd z_before = z;
    z_factor = backtrack(primal, [&](double step) {
      z = z_before + step * dz;
      return cholesky(z);
    });
    if (s_factor.size() == 0 || z_factor.size() == 0 || !y.allFinite()) {
      y = y_before;
      result.stop = LipSdpStop::kNumericalLimit;
      break;
    }
    result.points.push_back(unscaled(gap));
  }
  result.optimum_upper = Estimate(std::sqrt(std::ldexp(y(0), 2 * total)));
  result.optimum_lower = Estimate(std::sqrt(std::ldexp(std::max(best_dual, 0.0), 2 * total)));
  return result;
}

}  // namespace swarmcert::lipschitz

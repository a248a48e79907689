#include "lipschitz/interior_point.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>

#include "lipschitz/block_cholesky.h"
#include "lipschitz/dense_kernels.h"
#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Step lengths come from Lanczos, which can miss the least eigenvalue: shorten until Cholesky agrees.
constexpr double kBacktrack = 0.8;
/// Relative accuracy of that eigenvalue: for the centring parameter, which is a heuristic, and for the step.
constexpr double kRough = 0.1, kFine = 0.02;

/// The factor of S: dense, or by blocks where S has several that are narrow.
class SlackFactor {
 public:
  SlackFactor() = default;
  SlackFactor(const MatrixXd& s, const std::vector<Index>& begin) {
    if (is_narrow(begin)) {
      blocks_ = BlockCholesky::of(s, begin);
    } else {
      dense_ = cholesky(s);
    }
  }

  bool good() const { return blocks_ || dense_.size() > 0; }
  MatrixXd inverse() const { return blocks_ ? blocks_->inverse() : inverse_from_cholesky(dense_); }
  VectorXd congruence(const MatrixXd& d, const VectorXd& v) const {
    return blocks_ ? blocks_->congruence_times(d, v) : congruence_times(dense_, d, v);
  }
  const std::optional<BlockCholesky>& blocks() const { return blocks_; }

 private:
  /// Two neighbouring blocks are at most a fifth of the whole: below, the dense kernels are as fast.
  static bool is_narrow(const std::vector<Index>& begin) {
    Index widest = 0;
    for (std::size_t k = 0; k + 2 < begin.size(); ++k) widest = std::max(widest, begin[k + 2] - begin[k]);
    return begin.size() > 2 && 5 * widest <= begin.back();
  }

  MatrixXd dense_;
  std::optional<BlockCholesky> blocks_;
};

/// Largest alpha <= 1 with X + alpha D >= 0 kept at a distance, from the least eigenvalue of L^-1 D L^-T by Lanczos
/// with full reorthogonalisation, stopped at a relative accuracy. `congruence` gives L^-1 D L^-T v, with X = L L'.
template <class Congruence>
double step_length(Index n, const Congruence& congruence, double fraction, double accuracy) {
  const int steps = static_cast<int>(std::min<Index>(n, 30));
  MatrixXd basis(n, steps + 1);
  VectorXd alpha(steps), beta(steps);
  basis.col(0) = VectorXd::LinSpaced(n, 1.0, 1.7).normalized();
  double least = 0;
  for (int k = 0; k < steps; ++k) {
    VectorXd w = congruence(basis.col(k));
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

double step_length(const MatrixXd& factor, const MatrixXd& direction, double fraction, double accuracy) {
  const auto congruence = [&](const VectorXd& v) { return congruence_times(factor, direction, v); };
  return step_length(direction.rows(), congruence, fraction, accuracy);
}

double step_length(const SlackFactor& factor, const MatrixXd& direction, double fraction, double accuracy) {
  const auto congruence = [&](const VectorXd& v) { return factor.congruence(direction, v); };
  return step_length(direction.rows(), congruence, fraction, accuracy);
}

/// Tries `step`, then shorter ones, until `factor_at(step)` succeeds; empty if none does.
template <class FactorAt>
auto backtrack(double step, const FactorAt& factor_at) {
  const auto is_empty = [](const auto& factor) {
    if constexpr (std::is_same_v<std::decay_t<decltype(factor)>, MatrixXd>)
      return factor.size() == 0;
    else
      return !factor.good();
  };
  decltype(factor_at(step)) factor;
  for (int tries = 0; tries < 10 && is_empty(factor); ++tries) {
    factor = factor_at(step);
    step *= kBacktrack;
  }
  return factor;
}

/// (<A_j, X>)_j for symmetric X, given X A.
VectorXd functionals(const RankTwoInequality& it, const MatrixXd& x, const MatrixXd& x_a) {
  VectorXd v(1 + it.neurons());
  v(0) = x.diagonal().head(it.inputs()).sum();
  v.tail(it.neurons()) = -2.0 * x_a.bottomRows(it.neurons()).diagonal();
  return v;
}

void symmetrise(MatrixXd& x) { x = 0.5 * (x + MatrixXd(x.transpose())); }

/// M_ij = <A_i, Z A_j Y>, from rank-two constraints.
MatrixXd schur_complement(const RankTwoInequality& it, const MatrixXd& z, const MatrixXd& z_a,
                          const MatrixXd& y, const MatrixXd& y_a) {
  const Index n0 = it.inputs();
  const Index m = it.neurons();
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

std::optional<LipSdpStop> why_stopped(const Stop& stop) {
  if (stop.is_out_of_time()) return LipSdpStop::kTimeLimit;
  if (stop.is_cancelled()) return LipSdpStop::kCancelled;
  return std::nullopt;
}

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
    case LipSdpStop::kTimeLimit:
      return "time limit";
    case LipSdpStop::kNothingRun:
      break;
  }
  return "nothing run";
}

namespace {

/// Columns of a product between two looks at the clock.
constexpr Index kPanel = 512;

/// C += A B for square matrices, or less than that if it has to stop.
void add_large_product(MatrixXd& c, const MatrixXd& a, const MatrixXd& b, const Stop& stop) {
  for (Index column = 0; column < c.cols() && !stop.now(); column += kPanel) {
    const Index width = std::min(kPanel, c.cols() - column);
    add_product(c.middleCols(column, width), a, b.middleCols(column, width));
  }
}

/// C += A S^-1, by solving with the factor of S where it has blocks; or less than that if it has to stop.
void add_divided(MatrixXd& c, MatrixXd a, const SlackFactor& s, const MatrixXd& s_inverse, const Stop& stop) {
  if (!s.blocks()) return add_large_product(c, a, s_inverse, stop);
  s.blocks()->divide(a);
  c += a;
}

}  // namespace

InteriorPointResult minimise(const RankTwoInequality& it, const VectorXd& start,
                             const InteriorPointOptions& options) {
  use_one_blas_thread();
  const Index n = it.size();
  const Index m = it.neurons();
  VectorXd y = start;
  MatrixXd s = it.slack(y);
  const std::vector<Index> begin = it.slack_blocks();
  SlackFactor s_factor = options.stop.now() ? SlackFactor() : SlackFactor(s, begin);
  if (!s_factor.good()) {
    InteriorPointResult result;
    result.stop = why_stopped(options.stop).value_or(LipSdpStop::kNumericalLimit);
    return result;
  }
  // Z = mu S^-1 with trace 1 over the inputs: on the central path but for the constraints of the neurons.
  MatrixXd z = s_factor.inverse();
  z /= z.diagonal().head(it.inputs()).sum();
  MatrixXd z_factor = cholesky(z);

  VectorXd b = VectorXd::Zero(m + 1);
  b(0) = 1;
  InteriorPointResult result;
  result.points.push_back(y);
  result.gaps.push_back(kInfinity);
  result.stop = LipSdpStop::kIterationLimit;
  if (z_factor.size() == 0) {
    result.stop = LipSdpStop::kNumericalLimit;
    return result;
  }
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    // An iteration of a large program takes seconds: it ends between its products, and leaves the last iterate.
    const auto has_to_stop = [&] {
      const std::optional<LipSdpStop> why = why_stopped(options.stop);
      if (why) result.stop = *why;
      return why.has_value();
    };
    if (has_to_stop()) break;
    const MatrixXd s_inverse = s_factor.inverse();
    if (has_to_stop()) break;
    const MatrixXd z_a = it.times_a(z);
    const MatrixXd y_a = it.times_a(s_inverse);
    const VectorXd residual = b - functionals(it, z, z_a);
    const double mu = z.cwiseProduct(s).sum() / static_cast<double>(n);
    // Dual objective <C, Z>; with a feasible Z it is below the optimum.
    const double infeasibility = residual.cwiseAbs().maxCoeff();
    const double gap = static_cast<double>(n) * mu / y(0);
    if (infeasibility < 1e-9)
      result.best_dual = std::max(result.best_dual, y(0) - static_cast<double>(n) * mu);
    if (gap < options.relative_gap && infeasibility < options.infeasibility) {
      result.stop = LipSdpStop::kGapReached;
      break;
    }

    if (has_to_stop()) break;
    const SchurSolver schur(schur_complement(it, z, z_a, s_inverse, y_a));
    if (!schur.good()) {
      result.stop = LipSdpStop::kNumericalLimit;
      break;
    }
    const VectorXd inverse_functionals = functionals(it, s_inverse, y_a);

    // Predictor.
    const VectorXd dy_a = schur.solve(-b);
    const MatrixXd ds_a = it.linear(dy_a);
    MatrixXd dz_a = -z;
    add_divided(dz_a, it.times_patterned(-z, ds_a), s_factor, s_inverse, options.stop);
    if (has_to_stop()) break;
    symmetrise(dz_a);
    const double primal_a = step_length(z_factor, dz_a, 1.0, kRough);
    const double dual_a = step_length(s_factor, ds_a, 1.0, kRough);
    const double mu_a = (z + primal_a * dz_a).cwiseProduct(s + dual_a * ds_a).sum() / static_cast<double>(n);
    const double ratio = std::clamp(mu_a / mu, 0.0, 1.0);
    const double sigma = std::max(1e-6, ratio * ratio * (primal_a > 0.1 && dual_a > 0.1 ? ratio : 1.0));

    // Corrector.
    const MatrixXd q = it.times_patterned(dz_a, ds_a);
    VectorXd rhs = sigma * mu * inverse_functionals - b;
    const MatrixXd a_q = it.a_transposed_times(q);
    rhs.tail(m) += (q.bottomRows(m).array() * y_a.transpose().array()).rowwise().sum().matrix() +
                   (a_q.array() * s_inverse.bottomRows(m).array()).rowwise().sum().matrix();
    rhs(0) -= (q.topRows(it.inputs()).array() * s_inverse.topRows(it.inputs()).array()).sum();
    const VectorXd dy = schur.solve(rhs);
    const MatrixXd ds = it.linear(dy);
    MatrixXd dz = sigma * mu * s_inverse - z;
    add_divided(dz, it.times_patterned(-z, ds) - q, s_factor, s_inverse, options.stop);
    if (has_to_stop()) break;
    symmetrise(dz);
    const double fraction = std::min(0.98, 0.9 + 0.09 * std::min(primal_a, dual_a));
    const double primal = step_length(z_factor, dz, fraction, kFine);
    const double dual = step_length(s_factor, ds, fraction, kFine);

    if (has_to_stop()) break;
    const VectorXd y_before = y;
    s_factor = backtrack(dual, [&](double step) {
      y = y_before + step * dy;
      s = it.slack(y);
      return SlackFactor(s, begin);
    });
    const MatrixXd z_before = z;
    z_factor = backtrack(primal, [&](double step) {
      z = z_before + step * dz;
      return cholesky(z);
    });
    if (!s_factor.good() || z_factor.size() == 0 || !y.allFinite()) {
      y = y_before;
      result.stop = LipSdpStop::kNumericalLimit;
      break;
    }
    result.points.push_back(y);
    result.gaps.push_back(gap);
  }
  return result;
}

}  // namespace swarmcert::lipschitz

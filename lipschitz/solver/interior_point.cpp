#include "lipschitz/solver/interior_point.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>

#include "lipschitz/solver/block_cholesky.h"
#include "lipschitz/solver/dense_kernels.h"
#include "lipschitz/solver/schur_complement.h"
#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Step lengths come from the Lanczos method, which can miss the least eigenvalue. They are shortened by this factor
/// until Cholesky succeeds.
constexpr double kBacktrack = 0.8;
/// Relative accuracy of that eigenvalue: kRough for the centring parameter, which is a heuristic, kFine for the step.
constexpr double kRough = 0.1, kFine = 0.02;

/// The Cholesky factor of S: dense, or by blocks if S has several narrow blocks.
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
  /// Returns whether two adjacent blocks are at most a fifth of the matrix; otherwise the dense kernels are as fast.
  static bool is_narrow(const std::vector<Index>& begin) {
    Index widest = 0;
    for (std::size_t k = 0; k + 2 < begin.size(); ++k) widest = std::max(widest, begin[k + 2] - begin[k]);
    return begin.size() > 2 && 5 * widest <= begin.back();
  }

  MatrixXd dense_;
  std::optional<BlockCholesky> blocks_;
};

/// Returns the largest alpha <= 1 for which X + alpha D stays in the interior of the cone, from the least eigenvalue of
/// L^-1 D L^-T, X = L L', by the Lanczos method with full reorthogonalisation, stopped at a relative accuracy.
/// @param congruence returns L^-1 D L^-T v.
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

/// Tries `step`, then shorter steps, until `factor_at(step)` succeeds; returns an empty result if none does.
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

void symmetrise(MatrixXd& x) { x = 0.5 * (x + MatrixXd(x.transpose())); }

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

/// Columns of a product that are computed between two checks of the clock.
constexpr Index kPanel = 512;

/// C += A B for square matrices; incomplete if `stop` ends the computation.
void add_large_product(MatrixXd& c, const MatrixXd& a, const MatrixXd& b, const Stop& stop) {
  for (Index column = 0; column < c.cols() && !stop.now(); column += kPanel) {
    const Index width = std::min(kPanel, c.cols() - column);
    add_product(c.middleCols(column, width), a, b.middleCols(column, width));
  }
}

/// C += A S^-1, by solving with the factor of S if it has blocks; incomplete if `stop` ends the computation.
void add_divided(MatrixXd& c, MatrixXd a, const SlackFactor& s, const MatrixXd& s_inverse, const Stop& stop) {
  if (!s.blocks()) return add_large_product(c, a, s_inverse, stop);
  s.blocks()->divide(a);
  c += a;
}

/// Sums over the multipliers that are tied, and the way back.
class Ties {
 public:
  explicit Ties(const RankTwoInequality& inequality) : of_(inequality.ties()) {}

  VectorXd summed(VectorXd v) const {
    if (of_.empty()) return v;
    VectorXd result = VectorXd::Zero(2 + of_.back());
    result(0) = v(0);
    for (std::size_t i = 0; i < of_.size(); ++i) result(1 + of_[i]) += v(1 + static_cast<Index>(i));
    return result;
  }
  MatrixXd summed(MatrixXd m) const {
    if (of_.empty()) return m;
    MatrixXd rows(2 + of_.back(), m.cols());
    for (Index j = 0; j < m.cols(); ++j) rows.col(j) = summed(VectorXd(m.col(j)));
    MatrixXd result(rows.rows(), rows.rows());
    for (Index i = 0; i < rows.rows(); ++i)
      result.row(i) = summed(VectorXd(rows.row(i).transpose())).transpose();
    return result;
  }
  VectorXd spread(VectorXd y) const {
    if (of_.empty()) return y;
    VectorXd result(1 + static_cast<Index>(of_.size()));
    result(0) = y(0);
    for (std::size_t i = 0; i < of_.size(); ++i) result(1 + static_cast<Index>(i)) = y(1 + of_[i]);
    return result;
  }

 private:
  const std::vector<Index> of_;
};

/// Mehrotra's predictor-corrector method with the direction of Helmberg, Rendl, Vanderbei and Wolkowicz.
class Minimisation {
 public:
  Minimisation(const RankTwoInequality& inequality, const VectorXd& start,
               const InteriorPointOptions& options)
      : it_(inequality),
        options_(options),
        size_(static_cast<double>(inequality.size())),
        block_begin_(inequality.slack_blocks()),
        ties_(inequality),
        b_(VectorXd::Unit(1 + inequality.neurons(), 0)),
        y_(start),
        s_(inequality.slack(start)) {}

  InteriorPointResult run() {
    if (!begin()) return std::move(result_);
    result_.stop = LipSdpStop::kIterationLimit;
    while (result_.iterations < options_.max_iterations && iterate()) ++result_.iterations;
    return std::move(result_);
  }

 private:
  /// Data of the point at which an iteration starts.
  struct Point {
    MatrixXd s_inverse, z_a, y_a;
    double mu, gap, infeasibility;
  };
  struct Direction {
    VectorXd dy;
    MatrixXd ds, dz;
  };
  /// Largest step lengths along a direction.
  struct Lengths {
    double primal, dual;
  };

  /// Stores why the search ends. Returns false, so that callers can return the result.
  bool ends(LipSdpStop why) {
    result_.stop = why;
    return false;
  }

  /// Returns whether to stop. Called between the products of an iteration, which takes seconds for a large program; the
  /// last iterate is then kept.
  bool has_to_stop() {
    const std::optional<LipSdpStop> why = why_stopped(options_.stop);
    if (why) result_.stop = *why;
    return why.has_value();
  }

  /// Factorises the first iterates. Returns false if the start is not strictly feasible or there is no time.
  bool begin() {
    s_factor_ = options_.stop.now() ? SlackFactor() : SlackFactor(s_, block_begin_);
    if (!s_factor_.good()) return ends(why_stopped(options_.stop).value_or(LipSdpStop::kNumericalLimit));
    // Z = mu S^-1 with trace 1 over the inputs: on the central path except for the constraints of the neurons.
    z_ = s_factor_.inverse();
    z_ /= z_.diagonal().head(it_.inputs()).sum();
    z_factor_ = cholesky(z_);
    result_.points.push_back(y_);
    result_.gaps.push_back(kInfinity);
    return z_factor_.size() > 0 || ends(LipSdpStop::kNumericalLimit);
  }

  /// Makes one step. Returns false if it was the last one; the reason is stored in the result.
  bool iterate() {
    const std::optional<Point> point = linearise();
    if (!point) return false;
    note_dual(*point);
    if (point->gap < options_.relative_gap && point->infeasibility < options_.infeasibility)
      return ends(LipSdpStop::kGapReached);
    if (has_to_stop()) return false;
    const SchurSolver schur(
        ties_.summed(schur_complement(it_, z_, point->z_a, point->s_inverse, point->y_a)));
    if (!schur.good()) return ends(LipSdpStop::kNumericalLimit);

    const Direction predictor = direction(schur, -b_, -z_, nullptr, *point);
    if (has_to_stop()) return false;
    const Lengths predicted = lengths(predictor, 1.0, kRough);
    const double centring = centring_mu(predictor, predicted, point->mu);

    const MatrixXd q = it_.times_patterned(predictor.dz, predictor.ds);
    const Direction corrector =
        direction(schur, corrected(q, centring, *point), centring * point->s_inverse - z_, &q, *point);
    if (has_to_stop()) return false;
    const double fraction = std::min(0.98, 0.9 + 0.09 * std::min(predicted.primal, predicted.dual));
    const Lengths length = lengths(corrector, fraction, kFine);
    if (has_to_stop()) return false;
    if (!advance(corrector, length)) return ends(LipSdpStop::kNumericalLimit);
    result_.points.push_back(y_);
    result_.gaps.push_back(point->gap);
    return true;
  }

  std::optional<Point> linearise() {
    if (has_to_stop()) return std::nullopt;
    Point point;
    point.s_inverse = s_factor_.inverse();
    if (has_to_stop()) return std::nullopt;
    point.z_a = it_.times_a(z_);
    point.y_a = it_.times_a(point.s_inverse);
    point.infeasibility = ties_.summed(VectorXd(b_ - functionals(it_, z_, point.z_a))).cwiseAbs().maxCoeff();
    point.mu = z_.cwiseProduct(s_).sum() / size_;
    point.gap = size_ * point.mu / y_(0);
    return point;
  }

  /// Updates the best dual objective <C, Z>, which is a lower bound on the optimum if Z is feasible.
  void note_dual(const Point& point) {
    if (point.infeasibility < 1e-9) result_.best_dual = std::max(result_.best_dual, y_(0) - size_ * point.mu);
  }

  /// Computes dy from the Schur complement, then dS and dZ: dZ = `target` - (Z dS + `q`) S^-1, symmetrised.
  Direction direction(const SchurSolver& schur, const VectorXd& rhs, MatrixXd target, const MatrixXd* q,
                      const Point& point) {
    Direction found{ties_.spread(schur.solve(ties_.summed(rhs))), {}, std::move(target)};
    found.ds = it_.linear(found.dy);
    MatrixXd divided = it_.times_patterned(-z_, found.ds);
    if (q) divided -= *q;
    add_divided(found.dz, std::move(divided), s_factor_, point.s_inverse, options_.stop);
    symmetrise(found.dz);
    return found;
  }

  Lengths lengths(const Direction& step, double fraction, double accuracy) const {
    return {step_length(z_factor_, step.dz, fraction, accuracy),
            step_length(s_factor_, step.ds, fraction, accuracy)};
  }

  /// Returns the target sigma mu of the corrector, based on the reduction of mu by the predictor.
  double centring_mu(const Direction& predictor, const Lengths& length, double mu) const {
    const double after =
        (z_ + length.primal * predictor.dz).cwiseProduct(s_ + length.dual * predictor.ds).sum() / size_;
    const double ratio = std::clamp(after / mu, 0.0, 1.0);
    const bool is_long = length.primal > 0.1 && length.dual > 0.1;
    return std::max(1e-6, ratio * ratio * (is_long ? ratio : 1.0)) * mu;
  }

  /// Returns the right-hand side of the corrector with the second-order term `q` = dZ dS of the predictor.
  VectorXd corrected(const MatrixXd& q, double centring, const Point& point) const {
    const Index m = it_.neurons();
    VectorXd rhs = centring * functionals(it_, point.s_inverse, point.y_a) - b_;
    const MatrixXd a_q = it_.a_transposed_times(q);
    rhs.tail(m) += (q.bottomRows(m).array() * point.y_a.transpose().array()).rowwise().sum().matrix() +
                   (a_q.array() * point.s_inverse.bottomRows(m).array()).rowwise().sum().matrix();
    rhs(0) -= (q.topRows(it_.inputs()).array() * point.s_inverse.topRows(it_.inputs()).array()).sum();
    return rhs;
  }

  /// Moves both iterates, by less than `length` if a factorisation fails. Returns false, with y unchanged, if no step
  /// succeeds.
  bool advance(const Direction& step, const Lengths& length) {
    const VectorXd y_before = y_;
    s_factor_ = backtrack(length.dual, [&](double by) {
      y_ = y_before + by * step.dy;
      s_ = it_.slack(y_);
      return SlackFactor(s_, block_begin_);
    });
    const MatrixXd z_before = z_;
    z_factor_ = backtrack(length.primal, [&](double by) {
      z_ = z_before + by * step.dz;
      return cholesky(z_);
    });
    return s_factor_.good() && z_factor_.size() > 0 && y_.allFinite();
  }

  const RankTwoInequality& it_;
  const InteriorPointOptions& options_;
  const double size_;
  const std::vector<Index> block_begin_;
  const Ties ties_;
  const VectorXd b_;
  VectorXd y_;
  MatrixXd s_, z_, z_factor_;
  SlackFactor s_factor_;
  InteriorPointResult result_;
};

}  // namespace

InteriorPointResult minimise(const RankTwoInequality& it, const VectorXd& start,
                             const InteriorPointOptions& options) {
  use_one_blas_thread();
  return Minimisation(it, start, options).run();
}

}  // namespace swarmcert::lipschitz

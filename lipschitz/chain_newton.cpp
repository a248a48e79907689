#include "lipschitz/chain_newton.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lipschitz/dense_kernels.h"
#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// S of a chain in blocks 0 (the inputs), 1 .. K - 1 (the hidden layers).
class ChainSlack {
 public:
  explicit ChainSlack(const std::vector<MatrixXd>& stages) : stages_(stages) {
    begin_ = {0, stages.front().cols()};
    for (std::size_t k = 0; k + 1 < stages.size(); ++k) begin_.push_back(begin_.back() + stages[k].rows());
    first_gram_ = MatrixXd::Zero(stages.front().rows(), stages.front().rows());
    add_lower_gram(first_gram_, 1, stages.front());
    last_gram_ = stages.back().transpose() * stages.back();
  }

  std::size_t blocks() const { return begin_.size() - 1; }
  Index size() const { return begin_.back(); }
  Index inputs() const { return begin_[1]; }
  Index begin(std::size_t k) const { return begin_[k]; }
  Index width(std::size_t k) const { return begin_[k + 1] - begin_[k]; }
  /// Of y = (rho, t): where the multipliers of block k >= 1 begin.
  Index place(std::size_t k) const { return 1 + begin_[k] - inputs(); }
  /// M_k, from block k - 1 to block k.
  const MatrixXd& stage(std::size_t k) const { return stages_[k - 1]; }
  const MatrixXd& first_gram() const { return first_gram_; }  ///< M_1 M_1', its lower triangle
  const MatrixXd& last_gram() const { return last_gram_; }

 private:
  const std::vector<MatrixXd>& stages_;
  std::vector<Index> begin_;
  MatrixXd first_gram_, last_gram_;
};

/// S by block elimination: D_0 = rho I, D_k = 2 T_k - T_k G_k T_k (less the last Gram matrix in the last block) with
/// G_k = M_k D_{k-1}^-1 M_k'. Entries belong to block k; those of block 0 are empty.
struct ChainFactor {
  std::vector<MatrixXd> lower;  ///< L_k with D_k = L_k L_k'; what is above its diagonal means nothing
  std::vector<MatrixXd> half;   ///< B_k = M_k L_{k-1}^-T; empty for k = 1, where it is M_1 / sqrt(rho)
  std::vector<MatrixXd> gram;   ///< lower triangle of G_k = B_k B_k'
  double log_determinant = 0;   ///< of S
};

/// Nothing if S(y) is not safely positive definite.
std::optional<ChainFactor> factorise(const ChainSlack& chain, const VectorXd& y) {
  ChainFactor result;
  if (!(y(0) > 0)) return std::nullopt;
  result.lower.resize(1);
  result.half.resize(1);
  result.gram.resize(1);
  result.log_determinant = static_cast<double>(chain.inputs()) * std::log(y(0));
  for (std::size_t k = 1; k < chain.blocks(); ++k) {
    const auto t = y.segment(chain.place(k), chain.width(k));
    MatrixXd half, gram;
    if (k == 1) {
      gram = chain.first_gram() / y(0);
    } else {
      half = chain.stage(k);
      divide_by_lower_transposed(half, result.lower.back());
      gram = MatrixXd::Zero(half.rows(), half.rows());
      add_lower_gram(gram, 1, half);
    }
    MatrixXd d = -(t.asDiagonal() * gram * t.asDiagonal());
    d.diagonal() += 2.0 * t;
    if (k + 1 == chain.blocks()) d -= chain.last_gram();
    if (!cholesky_in_place(d)) return std::nullopt;
    result.log_determinant += 2 * d.diagonal().array().log().sum();
    result.lower.push_back(std::move(d));
    result.half.push_back(std::move(half));
    result.gram.push_back(std::move(gram));
  }
  return result;
}

/// The blocks of Y = S^-1 on the diagonal but the first, and W_k = -T_k M_k D_{k-1}^-1 for k > 1, of which L in
/// S = L D L' consists.
struct InverseBlocks {
  std::vector<MatrixXd> diagonal, left;
};

InverseBlocks inverse_blocks(const ChainSlack& chain, const ChainFactor& factor, const VectorXd& y) {
  const std::size_t blocks = chain.blocks();
  InverseBlocks result;
  result.diagonal.resize(blocks);
  result.left.resize(blocks);
  for (std::size_t k = 1; k < blocks; ++k) result.diagonal[k] = inverse_from_cholesky(factor.lower[k]);
  for (std::size_t k = blocks; --k > 1;) {  // Y_k-1,k-1 = D_k-1^-1 + W_k' Y_kk W_k
    result.left[k] = -(y.segment(chain.place(k), chain.width(k)).asDiagonal() * factor.half[k]);
    divide_by_lower(result.left[k], factor.lower[k - 1]);
    MatrixXd through = MatrixXd::Zero(result.left[k].rows(), result.left[k].cols());
    add_product(through, result.diagonal[k], result.left[k]);
    add_symmetric_product_transposed(result.diagonal[k - 1], result.left[k], through);
  }
  return result;
}

/// The gradient of log det S. Y_kk is what the log determinant changes by with D_k, all later blocks included.
VectorXd gradient(const ChainSlack& chain, const ChainFactor& factor, const InverseBlocks& inverse,
                  const VectorXd& y) {
  VectorXd result(1 + chain.size() - chain.inputs());
  for (std::size_t k = 1; k < chain.blocks(); ++k) {
    const auto t = y.segment(chain.place(k), chain.width(k));
    const MatrixXd& y_k = inverse.diagonal[k];
    // The row sums of Y_kk T G_k, element by element, of G_k's lower triangle.
    const MatrixXd lower = y_k.cwiseProduct(factor.gram[k].triangularView<Eigen::Lower>().toDenseMatrix());
    VectorXd through = lower * t + lower.transpose() * t;
    through -= lower.diagonal().cwiseProduct(t);
    result.segment(chain.place(k), chain.width(k)) = 2.0 * (y_k.diagonal() - through);
    if (k == 1)  // tr Y_00 = (inputs + tr(T_1 Y_11 T_1 G_1)) / rho
      result(0) = (static_cast<double>(chain.inputs()) + t.dot(through)) / y(0);
  }
  return result;
}

/// Rows from block `from` on of M_i X_{i-1} - X_i, for X with rows from block from - 1 on.
MatrixXd times_a_transposed(const ChainSlack& chain, std::size_t from, const MatrixXd& x) {
  const Index skipped = chain.begin(from - 1);
  MatrixXd result = -x.bottomRows(chain.size() - chain.begin(from));
  for (std::size_t i = from; i < chain.blocks(); ++i)
    add_product(result.middleRows(chain.begin(i) - chain.begin(from), chain.width(i)), chain.stage(i),
                x.middleRows(chain.begin(i - 1) - skipped, chain.width(i - 1)));
  return result;
}

/// The negative Hessian of log det S, its lower triangle: H_ij = tr(Y A_i Y A_j) =
/// 2 (a_i' Y a_j)(e_i' Y e_j) + 2 (a_i' Y e_j)(e_i' Y a_j) for neurons i and j.
/// Less than that if it has to stop.
MatrixXd hessian(const ChainSlack& chain, const VectorXd& y, const InverseBlocks& blocks, const Stop& stop) {
  const Index size = chain.size();
  MatrixXd h(1 + size - chain.inputs(), 1 + size - chain.inputs());
  // W_1, and Y_00 = I / rho + W_1' Y_11 W_1.
  const VectorXd scale = -y.segment(chain.place(1), chain.width(1)) / y(0);
  const MatrixXd first = scale.asDiagonal() * chain.stage(1);
  MatrixXd first_diagonal = MatrixXd::Identity(chain.inputs(), chain.inputs()) / y(0);
  MatrixXd through = MatrixXd::Zero(first.rows(), first.cols());
  add_product(through, blocks.diagonal[1], first);
  add_transposed_product(first_diagonal, first, through);
  // Columns of Y of the block at hand, from its row on; those of the block before follow from them.
  MatrixXd column = blocks.diagonal.back();
  for (std::size_t j = chain.blocks(); --j > 0 && !stop.now();) {
    const Index above = chain.width(j - 1), rows = size - chain.begin(j - 1), width = chain.width(j);
    MatrixXd before(rows, above);
    before.topRows(above) = j == 1 ? first_diagonal : blocks.diagonal[j - 1];
    before.bottomRows(rows - above).setZero();
    add_product(before.bottomRows(rows - above), -column, j == 1 ? first : blocks.left[j]);
    MatrixXd here(rows, width);
    here.topRows(above) = before.middleRows(above, width).transpose();
    here.bottomRows(rows - above) = column;
    MatrixXd y_a = -here;
    add_product_transposed(y_a, before, chain.stage(j));
    const MatrixXd a_y_a = times_a_transposed(chain, j, y_a);
    const MatrixXd a_y = times_a_transposed(chain, j, here);
    h.block(chain.place(j), chain.place(j), rows - above, width).array() =
        2.0 * (a_y_a.array() * column.array() + a_y.array() * y_a.bottomRows(rows - above).array());
    column = std::move(before);
  }
  if (stop.now()) return h;
  const MatrixXd a_y = times_a_transposed(chain, 1, column);
  h(0, 0) = column.topRows(chain.inputs()).squaredNorm();
  h.col(0).tail(h.rows() - 1) =
      -2.0 * a_y.cwiseProduct(column.bottomRows(size - chain.inputs())).rowwise().sum();
  return h;
}

/// Solves with the Hessian, scaled to a unit diagonal and factorised in place.
class NewtonMatrix {
 public:
  explicit NewtonMatrix(MatrixXd h)
      : factor_(std::move(h)), scale_(factor_.diagonal().cwiseSqrt().cwiseInverse()) {
    constexpr double kRegularisation = 1e-13;
    for (Index j = 0; j < factor_.cols(); ++j) {
      factor_.col(j).tail(factor_.rows() - j).array() *= scale_(j) * scale_.tail(factor_.rows() - j).array();
      factor_(j, j) += kRegularisation;
    }
    good_ = scale_.allFinite() && cholesky_in_place(factor_);
  }
  bool good() const { return good_; }
  VectorXd solve(const VectorXd& rhs) const {
    VectorXd v = scale_.cwiseProduct(rhs);
    solve_cholesky(factor_, v);
    return scale_.cwiseProduct(v);
  }

 private:
  MatrixXd factor_;
  VectorXd scale_;
  bool good_ = false;
};

/// The point of ECLipsE-Fast, scaled up: every Schur complement of S is then a multiple of I up to a factor of three.
VectorXd layerwise_start(const ChainSlack& chain) {
  constexpr double kInside = 1.5;
  VectorXd y(1 + chain.size() - chain.inputs());
  y(0) = 1;
  MatrixXd inverse = MatrixXd::Identity(chain.inputs(), chain.inputs());
  double largest = 1;
  for (std::size_t k = 1; k <= chain.blocks(); ++k) {
    MatrixXd half = MatrixXd::Zero(chain.stage(k).rows(), inverse.cols());
    add_product(half, chain.stage(k), inverse);
    MatrixXd through = MatrixXd::Zero(half.rows(), half.rows());
    add_product_transposed(through, half, chain.stage(k));
    largest = largest_eigenvalue(through);
    if (k == chain.blocks()) break;
    const double t = 1 / largest;
    y.segment(chain.place(k), chain.width(k)).setConstant(t);
    inverse = -t * t * through;
    inverse.diagonal().array() += 2 * t;
    if (!cholesky_in_place(inverse)) break;  // cannot be: the least eigenvalue is t
    invert_from_cholesky(inverse);
  }
  return kInside * largest * y;
}

/// A point with what is known of S there.
struct PathPoint {
  VectorXd y;
  double log_determinant = 0;  ///< of S
  InverseBlocks blocks;
  VectorXd log_gradient;  ///< of log det S
};

std::optional<PathPoint> path_point(const ChainSlack& chain, VectorXd y) {
  std::optional<ChainFactor> factor = factorise(chain, y);
  if (!factor) return std::nullopt;
  PathPoint point;
  point.blocks = inverse_blocks(chain, *factor, y);
  point.log_gradient = gradient(chain, *factor, point.blocks, y);
  point.log_determinant = factor->log_determinant;
  point.y = std::move(y);
  return point;
}

/// Minimises rho / mu - log det S by the BFGS method with limited memory, from Newton's matrix of a point nearby.
class Centring {
 public:
  Centring(const ChainSlack& chain, const NewtonMatrix& newton, double mu, double scale)
      : chain_(chain), newton_(newton), mu_(mu), scale_(scale) {}

  VectorXd residual(const PathPoint& at) const {
    VectorXd r = -at.log_gradient;
    r(0) += 1 / mu_;
    return r;
  }
  double value(const PathPoint& at) const { return at.y(0) / mu_ - at.log_determinant; }
  /// The norm of the residual by the inverse of Newton's matrix, about the distance from the path.
  double distance(const VectorXd& r) const {
    return std::sqrt(std::max(0.0, scale_ * r.dot(newton_.solve(r))));
  }

  /// Iterates until the estimated distance from the path is below `enough`, for at most kSteps steps.
  PathPoint run(PathPoint at, double enough, const Stop& stop) const {
    constexpr int kSteps = 12;
    std::vector<VectorXd> moves, changes;
    VectorXd r = residual(at);
    for (int step = 0; step < kSteps && !stop.now(); ++step) {
      const VectorXd d = -preconditioned(r, moves, changes);
      const double slope = r.dot(d);
      if (!(slope < 0) || -slope < enough * enough) break;
      std::optional<PathPoint> next;
      double length = 1;
      for (; length > 1e-7; length *= 0.5) {
        next = path_point(chain_, at.y + length * d);
        if (next && value(*next) <= value(at) + 1e-4 * length * slope) break;
        next.reset();
      }
      if (!next) break;
      const VectorXd after = residual(*next);
      moves.push_back(next->y - at.y);
      changes.push_back(after - r);
      if (!(moves.back().dot(changes.back()) > 0)) {
        moves.pop_back();
        changes.pop_back();
      }
      r = after;
      at = std::move(*next);
    }
    return at;
  }

 private:
  VectorXd preconditioned(VectorXd r, const std::vector<VectorXd>& moves,
                          const std::vector<VectorXd>& changes) const {
    std::vector<double> shares(moves.size());
    for (std::size_t i = moves.size(); i-- > 0;) {
      shares[i] = moves[i].dot(r) / moves[i].dot(changes[i]);
      r -= shares[i] * changes[i];
    }
    VectorXd d = scale_ * newton_.solve(r);
    for (std::size_t i = 0; i < moves.size(); ++i)
      d += (shares[i] - changes[i].dot(d) / moves[i].dot(changes[i])) * moves[i];
    return d;
  }

  const ChainSlack& chain_;
  const NewtonMatrix& newton_;
  double mu_, scale_;
};

/// The path as Newton's matrix at a point sees it: its own point at mu and its derivative there.
struct PathEstimate {
  double mu;
  VectorXd centre, slope;
};

/// Where the path is at mu, by Hermite's interpolation at the last `points` estimates (Newton's divided differences,
/// each place taken twice).
VectorXd extrapolated(const std::vector<PathEstimate>& path, std::size_t points, double mu) {
  const std::size_t nodes = 2 * points;
  std::vector<double> place;
  std::vector<VectorXd> column;
  for (std::size_t i = 0; i < nodes; ++i) {
    const PathEstimate& at = path[path.size() - 1 - i / 2];
    place.push_back(at.mu);
    column.push_back(at.centre);
  }
  VectorXd result = column[0];
  double product = 1;
  for (std::size_t order = 1; order < nodes; ++order) {
    for (std::size_t i = 0; i + order < nodes; ++i) {
      const double width = place[i + order] - place[i];
      if (width == 0)
        column[i] = path[path.size() - 1 - i / 2].slope;
      else
        column[i] = (column[i + 1] - column[i]) / width;
    }
    product *= mu - place[order - 1];
    result += product * column[0];
  }
  return result;
}

/// Moves along the path to mu (1 - alpha): alpha is what the last step reached and somewhat more, or less until the
/// extrapolated point is near enough to the path. Nothing if no alpha will do.
std::optional<PathPoint> follow(const ChainSlack& chain, const NewtonMatrix& newton,
                                const std::vector<PathEstimate>& path, double& reach, const Stop& stop) {
  constexpr double kLeastStep = 0.02, kFarthest = 2, kLonger = 1.5, kShorter = 0.8, kNear = 0.05;
  for (double alpha = std::min(1 - (1 - reach) / 2, kLonger * reach); alpha > kLeastStep; alpha *= kShorter) {
    // What S has near its boundary shrinks with mu, and its part of Newton's matrix grows with the square.
    const double mu = path.back().mu * (1 - alpha);
    const Centring centring(chain, newton, mu, (1 - alpha) * (1 - alpha));
    for (std::size_t points = path.size(); points > 0; --points) {
      if (stop.now()) return std::nullopt;
      std::optional<PathPoint> next = path_point(chain, extrapolated(path, points, mu));
      if (!next || !(centring.distance(centring.residual(*next)) < kFarthest)) continue;
      reach = alpha;
      return centring.run(std::move(*next), kNear, stop);
    }
  }
  return std::nullopt;
}

}  // namespace

InteriorPointResult minimise_chain(const std::vector<MatrixXd>& stages, const InteriorPointOptions& options) {
  use_one_blas_thread();
  // Below kStalledGap a step that gains nothing says that rounding has taken over.
  constexpr double kStalledGap = 1e-4, kFirstGap = 0.5, kOnPath = 1.5, kNear = 0.3, kFirstReach = 0.7;
  const ChainSlack chain(stages);
  const auto size = static_cast<double>(chain.size());
  InteriorPointResult result;
  std::optional<PathPoint> at;
  if (!options.stop.now()) at = path_point(chain, layerwise_start(chain));
  result.stop =
      at ? LipSdpStop::kIterationLimit : why_stopped(options.stop).value_or(LipSdpStop::kNumericalLimit);
  if (!at) return result;
  result.points.push_back(at->y);
  result.gaps.push_back(kInfinity);
  const VectorXd cost = VectorXd::Unit(at->y.size(), 0);
  const double first_mu = kFirstGap * at->y(0) / size;
  double reach = kFirstReach;
  bool is_on_path = false;
  std::vector<PathEstimate> path;
  constexpr std::size_t kMostPoints = 3;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    MatrixXd matrix = hessian(chain, at->y, at->blocks, options.stop);
    if (options.stop.now()) break;
    const NewtonMatrix newton(std::move(matrix));
    result.stop = LipSdpStop::kNumericalLimit;
    if (!newton.good()) break;
    // For any mu, v - u / mu is Newton's step to the path and u / mu^2 the path's derivative.
    const VectorXd u = newton.solve(cost), v = newton.solve(at->log_gradient);
    const double mu = is_on_path ? u(0) / v(0) : first_mu;  // the nearest point of the path
    const double distance =
        std::sqrt(std::max(0.0, at->log_gradient.dot(v) - 2 * v(0) / mu + u(0) / (mu * mu)));
    if (!(mu > 0) || !std::isfinite(distance)) break;
    const double gap = size * mu / at->y(0);
    if (distance < 1) result.best_dual = std::max(result.best_dual, at->y(0) - size * mu * (1 + distance));
    if (gap < options.relative_gap && distance < 1) {
      result.stop = LipSdpStop::kGapReached;
      break;
    }
    is_on_path = is_on_path || distance < kOnPath;
    const double before = at->y(0);
    if (distance < kOnPath) {
      path.push_back({mu, at->y + v - u / mu, u / (mu * mu)});
      if (path.size() > kMostPoints) path.erase(path.begin());
      at = follow(chain, newton, path, reach, options.stop);
      if (!at) break;
    } else {
      at = Centring(chain, newton, mu, 1).run(std::move(*at), kNear, options.stop);
    }
    if (gap < kStalledGap && !(at->y(0) < before)) break;
    result.points.push_back(at->y);
    result.gaps.push_back(gap);
    result.stop = LipSdpStop::kIterationLimit;
  }
  result.stop = why_stopped(options.stop).value_or(result.stop);
  return result;
}

}  // namespace swarmcert::lipschitz

#include "lipschitz/solver/chain_newton.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lipschitz/solver/chain_slack.h"
#include "lipschitz/solver/dense_kernels.h"
#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

/// Returns the point of ECLipsE-Fast, scaled up. Every Schur complement of S is then within a factor of three of a
/// multiple of I.
VectorXd layerwise_start(const ChainSlack& chain) {
  constexpr double kInside = 1.5;
  VectorXd y(1 + chain.neurons());
  y(0) = 1;
  MatrixXd gram = chain.first_gram();
  double largest = largest_eigenvalue(gram);
  for (std::size_t k = 1; k <= chain.layers(); ++k) {
    const double t = 1 / largest;
    y.segment(chain.place(k), chain.width(k)).setConstant(t);
    gram = layerwise_gram(chain.stage(k + 1), gram, t);
    if (gram.size() == 0) break;  // impossible: the least eigenvalue is t
    largest = largest_eigenvalue(gram);
  }
  return kInside * largest * y;
}

/// The same for layers with slopes in [1 - c, c], computed from the output backwards. R_k is the matrix required by the
/// layers behind layer k. For R_k <= l I and multipliers that are equal within the layer, the least l' with
/// R_{k-1} <= l' M_k' M_k is l c^2, at t = l c / (2 c - 1).
VectorXd layerwise_start_of_bent(const ChainSlack& chain) {
  constexpr double kInside = 1.5;
  VectorXd y = VectorXd::Ones(1 + chain.neurons());
  MatrixXd behind = chain.last_gram();
  for (std::size_t k = chain.layers(); k > 0; --k) {
    const double c = chain.slope(k), t = largest_eigenvalue(behind) * c / (2 * c - 1);
    y.segment(chain.place(k), chain.width(k)).setConstant(t);
    // M' (2 g T + T (2 T - R)^-1 T) M.
    MatrixXd inner = -behind;
    inner.diagonal().array() += 2 * t;
    if (!cholesky_in_place(inner)) break;  // impossible: the least eigenvalue is t / c
    MatrixXd half = t * chain.stage(k).transpose();
    divide_by_lower_transposed(half, inner);
    behind = MatrixXd::Zero(half.rows(), half.rows());
    add_lower_gram(behind, 1, half);
    add_lower_gram(behind, 2 * chain.bend(k) * t, chain.stage(k).transpose());
  }
  y(0) = largest_eigenvalue(behind);
  return kInside * y;
}

bool is_bent(const ChainSlack& chain) {
  bool result = false;
  for (std::size_t k = 1; k <= chain.layers(); ++k) result = result || chain.bend(k) > 0;
  return result;
}

/// Minimises rho / mu - log det S by limited-memory BFGS, preconditioned with the Newton matrix of a nearby point.
class Centring {
 public:
  Centring(const ChainSlack& chain, const NewtonMatrix& newton, double mu, double scale)
      : chain_(chain), newton_(newton), mu_(mu), scale_(scale) {}

  VectorXd residual(const ChainPoint& at) const {
    VectorXd r = -at.gradient;
    r(0) += 1 / mu_;
    return r;
  }
  double value(const ChainPoint& at) const { return at.y(0) / mu_ - at.log_determinant; }
  /// Returns the norm of the residual in the metric of the inverse Newton matrix: about the distance from the path.
  double distance(const VectorXd& r) const {
    return std::sqrt(std::max(0.0, scale_ * r.dot(newton_.solve(r))));
  }

  /// Iterates until the estimated distance from the path is below `enough`, for at most `steps` steps.
  ChainPoint run(ChainPoint at, double enough, int steps, const Stop& stop) const {
    constexpr double kFarthest = 8;  // far from the path a full step would leave the cone
    std::vector<VectorXd> moves, changes;
    VectorXd r = residual(at);
    for (int step = 0; step < steps && !stop.now(); ++step) {
      const VectorXd d = -preconditioned(r, moves, changes);
      const double slope = r.dot(d);
      if (!(slope < 0) || -slope < enough * enough) break;
      std::optional<ChainPoint> next;
      double length = std::min(1.0, kFarthest / (1 + std::sqrt(-slope)));
      for (; length > 1e-7; length *= 0.5) {
        next = chain_point(chain_, at.y + length * d);
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

/// The central path as estimated from the Newton matrix at one point: its point at mu and its derivative there.
struct PathEstimate {
  double mu;
  VectorXd centre, slope;
};

/// The central path as the Newton matrix at one point describes it: for any mu, v - u / mu is the Newton step to the
/// path and u / mu^2 the derivative of the path.
struct PathView {
  VectorXd u, v;
  double mu;        ///< the point of the path
  double distance;  ///< distance to that point in the norm of the Newton matrix

  bool good() const { return mu > 0 && std::isfinite(distance); }
  PathEstimate estimate(const VectorXd& y) const { return {mu, y + v - u / mu, u / (mu * mu)}; }
};

/// @param mu the point of the path; without it, the nearest one.
PathView view_of_path(const NewtonMatrix& newton, const ChainPoint& from, std::optional<double> mu) {
  PathView view = {newton.solve(VectorXd::Unit(from.y.size(), 0)), newton.solve(from.gradient), 0, 0};
  view.mu = mu.value_or(view.u(0) / view.v(0));
  view.distance = std::sqrt(
      std::max(0.0, from.gradient.dot(view.v) - 2 * view.v(0) / view.mu + view.u(0) / (view.mu * view.mu)));
  return view;
}

/// Returns an estimate of the path at mu by Hermite interpolation through the last `points` estimates (Newton's divided
/// differences with each node taken twice).
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

/// Moves along the path to mu (1 - alpha). The first alpha is somewhat larger than that of the last step; it is reduced
/// until the extrapolated point is close enough to the path. Returns nothing if no alpha is acceptable.
std::optional<ChainPoint> follow(const ChainSlack& chain, const NewtonMatrix& newton,
                                 const std::vector<PathEstimate>& path, double& reach, const Stop& stop) {
  constexpr double kLeastStep = 0.02, kFarthest = 2, kLonger = 1.3, kShorter = 0.7, kNear = 0.03;
  constexpr int kSteps = 12;
  for (double alpha = std::min(1 - (1 - reach) / 2, kLonger * reach); alpha > kLeastStep; alpha *= kShorter) {
    // The small eigenvalues of S shrink in proportion to mu, so their part of the Newton matrix grows as 1 / mu^2.
    const double mu = path.back().mu * (1 - alpha);
    const Centring centring(chain, newton, mu, (1 - alpha) * (1 - alpha));
    for (std::size_t points = path.size(); points > 0; --points) {
      if (stop.now()) return std::nullopt;
      std::optional<ChainPoint> next = chain_point(chain, extrapolated(path, points, mu));
      if (!next || !(centring.distance(centring.residual(*next)) < kFarthest)) continue;
      reach = alpha;
      return centring.run(std::move(*next), kNear, kSteps, stop);
    }
  }
  return std::nullopt;
}

}  // namespace

InteriorPointResult minimise_chain(const ChainSlack& chain, const InteriorPointOptions& options) {
  use_one_blas_thread();
  // Below the gap kStalledGap, a step without progress means that round-off dominates.
  constexpr double kStalledGap = 1e-4, kFirstGap = 0.2, kOnPath = 0.5, kNear = 0.01, kFirstReach = 0.7;
  constexpr int kMostSteps = 24;
  int steps = 3;  // centring steps per Newton matrix; few, because far from the path it changes quickly
  const auto size = static_cast<double>(chain.size());
  InteriorPointResult result;
  std::optional<ChainPoint> at;
  if (!options.stop.now())
    at = chain_point(chain, is_bent(chain) ? layerwise_start_of_bent(chain) : layerwise_start(chain));
  result.stop =
      at ? LipSdpStop::kIterationLimit : why_stopped(options.stop).value_or(LipSdpStop::kNumericalLimit);
  if (!at) return result;
  result.points.push_back(at->y);
  result.gaps.push_back(kInfinity);
  const double first_mu = kFirstGap * at->y(0) / size;
  double reach = kFirstReach;
  double last_distance = kInfinity;
  bool is_on_path = false, is_lost = false;
  std::vector<PathEstimate> path;
  constexpr std::size_t kMostPoints = 2;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    MatrixXd matrix = negative_hessian(chain, *at, options.stop);
    if (options.stop.now()) break;
    const NewtonMatrix newton(std::move(matrix));
    result.stop = LipSdpStop::kNumericalLimit;
    if (!newton.good()) break;
    const PathView view = view_of_path(newton, *at, is_on_path ? std::nullopt : std::optional(first_mu));
    if (!view.good()) break;
    const double mu = view.mu, distance = view.distance;
    const double gap = size * mu / at->y(0);
    if (distance < 1) result.best_dual = std::max(result.best_dual, at->y(0) - size * mu * (1 + distance));
    if (gap < options.relative_gap && distance < 1) {
      result.stop = LipSdpStop::kGapReached;
      break;
    }
    is_on_path = is_on_path || distance < kOnPath;
    const double before = at->y(0);
    std::optional<ChainPoint> next;
    if (distance < kOnPath) {
      path.push_back(view.estimate(at->y));
      if (path.size() > kMostPoints) path.erase(path.begin());
      next = follow(chain, newton, path, reach, options.stop);
      if (!next && is_lost) break;
      is_lost = !next.has_value();
    }
    if (!next) {  // moves closer to the path, where its estimate is more accurate
      if (is_lost) path.clear();
      if (distance > last_distance / 2) steps = std::min(2 * steps, kMostSteps);
      last_distance = distance;
      next = Centring(chain, newton, mu, 1).run(*at, kNear, steps, options.stop);
    }
    at = std::move(next);
    if (gap < kStalledGap && !(at->y(0) < before)) break;
    result.points.push_back(at->y);
    result.gaps.push_back(gap);
    result.stop = LipSdpStop::kIterationLimit;
  }
  result.stop = why_stopped(options.stop).value_or(result.stop);
  return result;
}

std::optional<InteriorPointResult> minimise_long_chain(const ChainSlack& chain,
                                                       InteriorPointOptions options) {
  constexpr Index kMostDense = 300, kMostAgain = 1500;
  constexpr int kMoreIterations = 3;
  constexpr double kEnough = 1e-6, kLongGap = 5e-7;
  if (chain.neurons() <= kMostDense) return std::nullopt;
  options.max_iterations *= kMoreIterations;
  options.relative_gap = std::max(options.relative_gap, kLongGap);
  InteriorPointResult found = minimise_chain(chain, options);
  const bool is_enough =
      found.stop == LipSdpStop::kGapReached || (!found.gaps.empty() && found.gaps.back() < kEnough);
  if (is_enough || is_interrupted(found.stop) || chain.size() > kMostAgain) return found;
  return std::nullopt;
}

}  // namespace swarmcert::lipschitz

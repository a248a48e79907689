#include "lipschitz/lower/region_walk.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A walk ends after this many successive regions without a steeper one.
constexpr int kPatience = 100;
/// A walk starts at the steepest of this many random points.
constexpr int kStarts = 50;
/// Maximum number of Newton steps towards the centre of a region, which need not be accurate.
constexpr int kCentringSteps = 8;
constexpr double kCentred = 0.3;  ///< Newton decrement below which a point counts as central
/// The next region is entered behind the facet by this share of the distance to the next facet on the ray.
constexpr double kStepBehind = 0.1;
/// If the domain is unbounded: distances from the centre at which walks start, and the range of R of their regions, in
/// units of the median distance of the first stage's kinks.
constexpr double kNearestStart = 0.1, kFarthestStart = 10, kLeastReach = 1, kLargestReach = 1000;
/// Start distances of walks at geometrically spaced scales, because kinks of later layers may lie anywhere.
constexpr double kLadderNearest = 1e-3, kLadderFarthest = 1e5;
/// Largest distance along a ray at which the slope at infinity is evaluated, and the factor between distances.
constexpr double kFarOut = 1e12, kFarther = 4;
/// A slope along a ray counts as the slope at infinity if they agree to this relative accuracy.
constexpr double kSlopeAtInfinity = 1e-9;

/// Solves with H = normals diag(1/d^2) normals' + diag(bounds): by a Cholesky factorisation of H or, if there are more
/// variables than neurons, of I + S' diag(bounds)^-1 S with S = normals diag(1/d) (Woodbury).
class BarrierHessian {
 public:
  BarrierHessian(const MatrixXd& scaled_normals, const VectorXd& bounds)
      : normals_(scaled_normals), bounds_(bounds), wide_(scaled_normals.rows() > scaled_normals.cols()) {
    if (wide_) {
      damped_ = bounds.cwiseInverse().asDiagonal() * normals_;
      MatrixXd inner = normals_.transpose() * damped_;
      inner.diagonal().array() += 1;
      factor_.compute(inner);
    } else {
      MatrixXd hessian = bounds_.asDiagonal();
      hessian.selfadjointView<Eigen::Lower>().rankUpdate(normals_);
      factor_.compute(hessian);
    }
  }

  template <typename Right>
  MatrixXd solve(const Right& right) const {
    if (!wide_) return factor_.solve(right);
    MatrixXd result = bounds_.cwiseInverse().asDiagonal() * right;
    result -= damped_ * factor_.solve(normals_.transpose() * result);
    return result;
  }

 private:
  const MatrixXd& normals_;
  const VectorXd& bounds_;
  bool wide_;
  MatrixXd damped_;
  Eigen::LLT<MatrixXd> factor_;
};

VectorXd reciprocal(const VectorXd& distances) {
  return distances.unaryExpr([](double d) { return d == 0 ? 0.0 : 1 / d; });
}

/// Contribution of the bounds of the variables to the diagonal of the barrier's Hessian and to its gradient.
struct BoundTerms {
  VectorXd hessian, gradient;
};
BoundTerms bound_terms(const SearchNetwork& network, const VectorXd& z, double reach) {
  BoundTerms terms{VectorXd(z.size()), VectorXd(z.size())};
  for (int v = 0; v < network.variables(); ++v) {
    if (network.boxed[v]) {
      const double below = 1 / (1 + z[v]);
      const double above = 1 / (1 - z[v]);
      terms.hessian[v] = below * below + above * above;
      terms.gradient[v] = above - below;
    } else {
      terms.hessian[v] = 2 / (reach * reach);
      terms.gradient[v] = 2 / (reach * reach) * z[v];
    }
  }
  return terms;
}

/// Returns a lower bound on the largest eigenvalue of a small symmetric matrix by `steps` power iterations from v.
double power_iteration(const MatrixXd& matrix, VectorXd v, int steps) {
  double value = 0;
  for (int step = 0; step < steps; ++step) {
    v = (matrix * v).eval();
    value = v.norm();
    if (!(value > 0)) return 0;
    v /= value;
  }
  return value;
}

}  // namespace

RegionWalk::RegionWalk(const SearchNetwork& network, std::uint64_t seed, const std::vector<VectorXd>& starts,
                       Where where)
    : network_(network),
      random_(seed),
      starts_(starts.rbegin(), starts.rend()),
      all_move_(std::all_of(network.stages.begin(), network.stages.end(),
                            [](const SearchStage& stage) { return stage.moved == stage.weights.rows(); })) {
  if (where == Where::kAmongKinks) return;
  recession_ = network;
  for (SearchStage& stage : recession_->stages) stage.biases.setZero();
}

VectorXd RegionWalk::random_point(double nearest, double farthest) {
  VectorXd z(network_.variables());
  double square = 0;
  for (int v = 0; v < network_.variables(); ++v) {
    if (network_.boxed[v]) {
      z[v] = 2 * random_.uniform() - 1;
      z[v] *= 1 - 1e-9;  // stays inside despite round-off
    } else {
      z[v] = random_.bell();
      square += z[v] * z[v];
    }
  }
  const double radius = random_.log_uniform(nearest, farthest);
  for (int v = 0; v < network_.variables(); ++v) {
    if (!network_.boxed[v] && square > 0) z[v] *= radius / std::sqrt(square);
  }
  return z;
}

void RegionWalk::move_to(const VectorXd& inputs, VectorXd& z, int first) const {
  for (int v = first; v < network_.variables(); ++v) {
    const int k = network_.coordinate[static_cast<std::size_t>(v)];
    if (k >= inputs.size()) return;
    z[v] = (inputs[k] - network_.centre[v]) / network_.scale[v];
    if (network_.boxed[v]) z[v] = std::clamp(z[v], -1 + 1e-9, 1 - 1e-9);
  }
}

void RegionWalk::start_walk() {
  queue_ = {};
  queued_.clear();
  best_of_walk_ = -1;
  entered_in_vain_ = 0;
  reach_ = random_.log_uniform(kLeastReach, kLargestReach);
  if (!recession_) {
    queue_.push(steepest_start(kNearestStart, kFarthestStart));
  } else if (walks_++ % 2 == 0) {
    queue_.push(start_at_infinity());
  } else {
    queue_.push(steepest_start(kLadderNearest, kLadderFarthest));
  }
  if (!starts_.empty()) starts_.pop_back();
}

RegionWalk::Candidate RegionWalk::steepest_start(double nearest, double farthest) {
  Candidate start{-1, VectorXd(), true};
  for (int i = 0; i < kStarts; ++i) {
    VectorXd z = random_point(nearest, farthest);
    if (!starts_.empty()) move_to(starts_.back(), z);
    const double slope = local_slope(network_, z).slope;
    if (slope > start.slope) start = {slope, std::move(z), true};
  }
  return start;
}

RegionWalk::Candidate RegionWalk::start_at_infinity() {
  Candidate steepest{-1, VectorXd(), true};
  for (int i = 0; i < kStarts; ++i) {
    VectorXd direction = random_point(1, 1);
    const double slope = local_slope(*recession_, direction).slope;
    if (slope > steepest.slope) steepest = {slope, std::move(direction), true};
  }
  const VectorXd direction = steepest.z;
  const double slope = steepest.slope;
  for (double t = 1; t < kFarOut; t *= kFarther) {
    steepest.z = t * direction;
    steepest.slope = local_slope(network_, steepest.z).slope;
    if (steepest.slope >= slope * (1 - kSlopeAtInfinity)) break;
  }
  return steepest;
}

bool RegionWalk::enter(int regions, const Stop& stop) {
  for (int i = 0; i < regions; ++i) {
    if (stop.now()) return false;
    ++entered_in_vain_;
    VectorXd z;
    if (take_steepest(z)) enter(std::move(z));
  }
  return true;
}

bool RegionWalk::take_steepest(VectorXd& z) {
  if (queue_.empty() || entered_in_vain_ > kPatience) start_walk();
  while (!queue_.empty()) {
    Candidate candidate = queue_.top();
    queue_.pop();
    if (!candidate.evaluated) {
      const LocalSlope here = local_slope(network_, candidate.z);
      if (entered_.count(here.pattern) > 0) continue;
      candidate.slope = here.slope;
      candidate.evaluated = true;
      if (!queue_.empty() && candidate < queue_.top()) {
        queue_.push(std::move(candidate));
        continue;
      }
    }
    z = std::move(candidate.z);
    return true;
  }
  return false;
}

void RegionWalk::enter(VectorXd z) {
  const LinearRegion region = linear_region(network_, z);
  if (!region.jacobian.allFinite() || !entered_.insert(region.pattern).second) return;

  // Damped Newton steps: the barrier is self-concordant, so they stay within the region.
  VectorXd distances = region.distances;
  for (int step = 0; step < kCentringSteps; ++step) {
    const VectorXd inverse = reciprocal(distances);
    const BoundTerms bounds = bound_terms(network_, z, reach_);
    const MatrixXd scaled = region.normals * inverse.asDiagonal();
    const VectorXd gradient = bounds.gradient - region.normals * inverse;
    const VectorXd newton = -BarrierHessian(scaled, bounds.hessian).solve(gradient);
    if (!newton.allFinite()) break;  // z is on the boundary of the box, e.g. because a kink lies there
    const double decrement = std::sqrt(std::max(0.0, -newton.dot(gradient)));
    const double length = decrement < 0.25 ? 1.0 : 1 / (1 + decrement);
    z += length * newton;
    distances += length * (region.normals.transpose() * newton);
    if (decrement < kCentred) break;
  }
  LinearRegion centred = region;
  centred.distances = distances;
  queue_neighbours(centred, z);
}

void RegionWalk::keep(const VectorXd& z, double slope) {
  if (steepest_.size() == kKept && slope <= steepest_.back().slope) return;
  if (steepest_.size() == kKept) steepest_.pop_back();
  const auto place =
      std::find_if(steepest_.begin(), steepest_.end(), [&](const Found& f) { return f.slope < slope; });
  steepest_.insert(place, {z, slope});
}

/// The first kink on a ray from the centre, its distance, and the distance of the next kink or bound.
struct RegionWalk::Hit {
  Eigen::Index facet = -1;
  double first = kInfinity;
  double second = kInfinity;
};

void RegionWalk::queue_neighbours(const LinearRegion& region, const VectorXd& z) {
  const MatrixXd square = gram(region.jacobian);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(square);
  const VectorXd top = eigen.eigenvectors().col(square.cols() - 1);
  const double slope = std::sqrt(std::max(0.0, eigen.eigenvalues()[square.cols() - 1]));
  keep(z, slope);
  if (slope > best_of_walk_ * (1 + 1e-9)) {
    best_of_walk_ = slope;
    entered_in_vain_ = 0;
  }

  std::vector<Eigen::Index> kinks;  // kinks that can change the slope
  for (Eigen::Index i = 0; i < region.distances.size(); ++i) {
    if (region.distances[i] != 0 && region.moved[static_cast<std::size_t>(i)]) kinks.push_back(i);
  }
  const VectorXd distances = region.distances(kinks);
  const MatrixXd normals = region.normals(Eigen::all, kinks);
  const MatrixXd scaled = region.normals * reciprocal(region.distances).asDiagonal();
  const BoundTerms bounds = bound_terms(network_, z, reach_);
  // Ray i moves towards kink i. Column i of `rates` contains the inverse distances along ray i to all kinks.
  MatrixXd rays = BarrierHessian(scaled, bounds.hessian).solve(normals);
  for (Eigen::Index i = 0; i < rays.cols(); ++i) rays.col(i) *= distances[i] > 0 ? -1 : 1;
  const MatrixXd rates = -(reciprocal(distances).asDiagonal() * (normals.transpose() * rays));
  if (!rates.allFinite()) return;
  std::vector<char> seen(kinks.size(), 0);
  for (Eigen::Index target = 0; target < rays.cols(); ++target) {
    const Hit hit = first_hit(rates.col(target), rays.col(target), z);
    if (hit.facet < 0 || hit.second <= hit.first || seen[static_cast<std::size_t>(hit.facet)]) continue;
    seen[static_cast<std::size_t>(hit.facet)] = 1;
    const Eigen::Index neuron = kinks[static_cast<std::size_t>(hit.facet)];
    const std::uint64_t pattern = region.pattern ^ pattern_key(static_cast<int>(neuron));
    if (entered_.count(pattern) > 0 || !queued_.insert(pattern).second) continue;
    const double second = std::isfinite(hit.second) ? hit.second : 2 * hit.first;
    VectorXd behind = z + (hit.first + kStepBehind * (second - hit.first)) * rays.col(target);
    queue_.push({slope_behind(region, neuron, square, top), std::move(behind), all_move_});
  }
}

RegionWalk::Hit RegionWalk::first_hit(const VectorXd& rates, const VectorXd& ray, const VectorXd& z) const {
  Hit hit;
  const double largest = rates.size() > 0 ? rates.maxCoeff() : 0;
  if (!(largest > 0)) return hit;
  hit.facet = std::find(rates.begin(), rates.end(), largest) - rates.begin();
  hit.first = 1 / largest;
  const double same = largest * (1 - 1e-9);  // coinciding kinks, such as those of equal neurons, count as one
  double next = 0;
  for (const double rate : rates) next = std::max(next, rate < same ? rate : 0.0);
  if (next > 0) hit.second = 1 / next;
  for (int v = 0; v < network_.variables(); ++v) {
    if (!network_.boxed[v] || ray[v] == 0) continue;
    hit.second = std::min(hit.second, ((ray[v] > 0 ? 1 : -1) - z[v]) / ray[v]);
  }
  return hit;
}

double RegionWalk::slope_behind(const LinearRegion& region, Eigen::Index neuron, const MatrixXd& square,
                                const VectorXd& top) const {
  const double switched = region.on[static_cast<std::size_t>(neuron)] ? -1 : 1;
  const VectorXd gradient = switched * region.lengths[neuron] *
                            block_columns(network_, region.normals.col(neuron).transpose()).transpose();
  const VectorXd effect = region.effects.col(neuron);
  // Computes the Gram matrix of J + effect gradient'.
  const bool by_inputs = region.jacobian.cols() <= region.jacobian.rows();
  const VectorXd& own = by_inputs ? gradient : effect;
  VectorXd cross = by_inputs ? effect.squaredNorm() / 2 * own : gradient.squaredNorm() / 2 * own;
  if (by_inputs) {
    cross += region.jacobian.transpose() * effect;
  } else {
    cross += region.jacobian * gradient;
  }
  return std::sqrt(power_iteration(square + cross * own.transpose() + own * cross.transpose(), top, 8));
}

}  // namespace swarmcert::lipschitz

#include "lipschitz/region_walk.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Regions that a walk enters without finding a steeper one before it gives up.
constexpr int kPatience = 100;
/// Random points of which a walk starts at the steepest.
constexpr int kStarts = 50;
/// Newton steps towards a region's centre; the centre need not be accurate.
constexpr int kCentringSteps = 8;
constexpr double kCentred = 0.3;  ///< Newton decrement at which a point counts as central
/// How far behind a facet the next region is entered, as a part of the way from that facet to the next one.
constexpr double kStepBehind = 0.1;
/// Distances from the centre at which walks start where the domain is open, and the reach R of their regions, in
/// units of the median distance of the first stage's kinks.
constexpr double kNearest = 0.1, kFarthest = 10, kLeastReach = 1, kLargestReach = 1000;

/// low * (high / low)^u for a uniform u: log-uniform, with square roots instead of libm.
double log_uniform(SearchRandom& random, double low, double high) {
  double value = low;
  double steps = random.uniform();
  double ratio = high / low;
  for (int halvings = 0; halvings < 20; ++halvings) {  // ratio^u by the binary digits of u
    ratio = std::sqrt(ratio);
    steps *= 2;
    if (steps >= 1) {
      value *= ratio;
      steps -= 1;
    }
  }
  return value;
}

/// H = normals diag(1/d^2) normals' + diag(bounds), and H^-1 times something: by Cholesky of H or, where there are
/// more variables than neurons, of I + S' diag(bounds)^-1 S with S = normals diag(1/d) (Woodbury).
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
      MatrixXd hessian = normals_ * normals_.transpose();
      hessian.diagonal() += bounds_;
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

/// Diagonal of the barrier's Hessian, and its gradient, that stem from the variables' own bounds.
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

/// Largest eigenvalue of a small symmetric matrix by `steps` power iterations from v: at most the true one.
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

/// J'J or JJ', whichever is smaller.
MatrixXd gram(const MatrixXd& jacobian) {
  if (jacobian.cols() <= jacobian.rows()) return jacobian.transpose() * jacobian;
  return jacobian * jacobian.transpose();
}

double root_of_largest(const Eigen::SelfAdjointEigenSolver<MatrixXd>& eigen) {
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[eigen.eigenvalues().size() - 1]));
}

MatrixXd block_of(const SearchNetwork& network, const MatrixXd& full) {
  MatrixXd result(full.rows(), static_cast<Eigen::Index>(network.block.size()));
  for (Eigen::Index c = 0; c < result.cols(); ++c) {
    const int v = network.block[static_cast<std::size_t>(c)];
    result.col(c) = full.col(v) / network.scale[v];
  }
  return result;
}

/// Fixed random keys: the hash of a pattern is the exclusive or of its active neurons' keys.
std::uint64_t key(int neuron) {
  return SearchRandom(0x5bd1e995u + static_cast<std::uint64_t>(neuron)).bits();
}

}  // namespace

std::uint64_t SearchRandom::bits() {
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double SearchRandom::uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

double SearchRandom::bell() {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += uniform();
  return sum;
}

LinearRegion linear_region(const SearchNetwork& network, const VectorXd& z) {
  const int neurons = network.neurons();
  LinearRegion region;
  region.distances.resize(neurons);
  region.lengths.resize(neurons);
  region.normals.resize(z.size(), neurons);
  region.effects.resize(network.outputs(), neurons);
  region.on.resize(static_cast<std::size_t>(neurons));
  region.pattern = 0;
  VectorXd values = z;
  MatrixXd gradients;  // [width x variables] of the values
  int first = 0;
  for (std::size_t k = 0; k < network.stages.size(); ++k) {
    const SearchStage& stage = network.stages[k];
    values = (stage.weights * values + stage.biases).eval();
    gradients = k == 0 ? stage.weights : MatrixXd(stage.weights * gradients);
    if (k + 1 == network.stages.size()) break;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      const int neuron = first + static_cast<int>(i);
      const double length = gradients.row(i).norm();
      const bool has_kink = !stage.passes[static_cast<std::size_t>(i)] && length > 0 && values[i] != 0;
      const bool on = stage.passes[static_cast<std::size_t>(i)] || values[i] > 0;
      region.lengths[neuron] = length;
      region.distances[neuron] = has_kink ? values[i] / length : 0.0;
      region.normals.col(neuron) = gradients.row(i).transpose() * (has_kink ? 1 / length : 0.0);
      region.on[static_cast<std::size_t>(neuron)] = on;
      if (on) {
        region.pattern ^= key(neuron);
      } else {
        values[i] = 0;
        gradients.row(i).setZero();
      }
    }
    first += static_cast<int>(values.size());
  }
  region.jacobian = block_of(network, gradients);
  MatrixXd effects = network.stages.back().weights;  // of the outputs h of the stage before
  for (std::size_t k = network.stages.size() - 1; k-- > 0;) {
    const Eigen::Index width = effects.cols();
    first -= static_cast<int>(width);
    region.effects.middleCols(first, width) = effects;
    for (Eigen::Index i = 0; i < width; ++i) {
      if (!region.on[static_cast<std::size_t>(first + i)]) effects.col(i).setZero();
    }
    if (k > 0) effects = (effects * network.stages[k].weights).eval();
  }
  return region;
}

double local_slope(const SearchNetwork& network, const VectorXd& z) {
  VectorXd values = z;
  MatrixXd gradients;
  for (std::size_t k = 0; k < network.stages.size(); ++k) {
    const SearchStage& stage = network.stages[k];
    values = (stage.weights * values + stage.biases).eval();
    gradients = k == 0 ? block_of(network, stage.weights) : MatrixXd(stage.weights * gradients);
    if (k + 1 == network.stages.size()) break;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (values[i] > 0 || stage.passes[static_cast<std::size_t>(i)]) continue;
      values[i] = 0;
      gradients.row(i).setZero();
    }
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(gram(gradients), Eigen::EigenvaluesOnly);
  return root_of_largest(eigen);
}

Chord chord(const SearchNetwork& network, const LinearRegion& region, const VectorXd& z,
            const VectorXd& direction) {
  Chord result{-kInfinity, kInfinity};
  const auto hit = [&](double t) {
    if (t > 0) result.upper = std::min(result.upper, t);
    if (t < 0) result.lower = std::max(result.lower, t);
  };
  const VectorXd speeds = region.normals.transpose() * direction;
  for (Eigen::Index i = 0; i < speeds.size(); ++i) {
    if (speeds[i] != 0) hit(-region.distances[i] / speeds[i]);
  }
  for (int v = 0; v < network.variables(); ++v) {
    if (!network.boxed[v] || direction[v] == 0) continue;
    hit((1 - z[v]) / direction[v]);
    hit((-1 - z[v]) / direction[v]);
  }
  return result;
}

RegionWalk::RegionWalk(const SearchNetwork& network, std::uint64_t seed) : network_(network), random_(seed) {}

VectorXd RegionWalk::random_point() {
  VectorXd z(network_.variables());
  double square = 0;
  for (int v = 0; v < network_.variables(); ++v) {
    if (network_.boxed[v]) {
      z[v] = 2 * random_.uniform() - 1;
      z[v] *= 1 - 1e-9;  // inside, whatever the rounding
    } else {
      z[v] = random_.bell();
      square += z[v] * z[v];
    }
  }
  const double radius = log_uniform(random_, kNearest, kFarthest);
  for (int v = 0; v < network_.variables(); ++v) {
    if (!network_.boxed[v] && square > 0) z[v] *= radius / std::sqrt(square);
  }
  return z;
}

void RegionWalk::start_walk() {
  queue_ = {};
  queued_.clear();
  best_of_walk_ = -1;
  entered_in_vain_ = 0;
  reach_ = log_uniform(random_, kLeastReach, kLargestReach);
  Candidate start{-1, VectorXd()};
  for (int i = 0; i < kStarts; ++i) {
    VectorXd z = random_point();
    const double slope = local_slope(network_, z);
    if (slope > start.slope || i == 0) start = {slope, std::move(z)};
  }
  queue_.push(std::move(start));
}

void RegionWalk::enter(int regions, const std::atomic<bool>* cancelled) {
  for (int i = 0; i < regions; ++i) {
    if (cancelled != nullptr && *cancelled) return;
    if (queue_.empty() || entered_in_vain_ >= kPatience) start_walk();
    enter_steepest();
  }
}

void RegionWalk::enter_steepest() {
  VectorXd z = queue_.top().z;
  queue_.pop();
  ++entered_in_vain_;
  const LinearRegion region = linear_region(network_, z);
  if (!region.jacobian.allFinite() || !entered_.insert(region.pattern).second) return;

  // Damped Newton steps: the barrier is self-concordant, so they stay within the region.
  VectorXd distances = region.distances;
  const VectorXd start = z;
  for (int step = 0; step < kCentringSteps; ++step) {
    const VectorXd inverse = reciprocal(distances);
    const BoundTerms bounds = bound_terms(network_, z, reach_);
    const MatrixXd scaled = region.normals * inverse.asDiagonal();
    const VectorXd gradient = bounds.gradient - region.normals * inverse;
    const VectorXd newton = -BarrierHessian(scaled, bounds.hessian).solve(gradient);
    const double decrement = std::sqrt(std::max(0.0, -newton.dot(gradient)));
    if (!std::isfinite(decrement)) break;
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

void RegionWalk::queue_neighbours(const LinearRegion& region, const VectorXd& z) {
  const MatrixXd square = gram(region.jacobian);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(square);
  const double slope = root_of_largest(eigen);
  const VectorXd top = eigen.eigenvectors().col(square.cols() - 1);
  keep(z, slope);
  if (slope > best_of_walk_ * (1 + 1e-9)) {
    best_of_walk_ = slope;
    entered_in_vain_ = 0;
  }

  const VectorXd inverse = reciprocal(region.distances);
  const MatrixXd scaled = region.normals * inverse.asDiagonal();
  const BoundTerms bounds = bound_terms(network_, z, reach_);
  const MatrixXd rays = BarrierHessian(scaled, bounds.hessian).solve(region.normals);
  const MatrixXd speeds = region.normals.transpose() * rays;
  if (!speeds.allFinite()) return;
  const bool by_inputs = region.jacobian.cols() <= region.jacobian.rows();
  std::vector<char> is_queued(region.on.size(), 0);
  for (Eigen::Index target = 0; target < speeds.cols(); ++target) {
    if (region.distances[target] == 0) continue;
    const double sign = region.distances[target] > 0 ? -1 : 1;
    double first = kInfinity;
    double second = kInfinity;
    Eigen::Index facet = -1;
    for (Eigen::Index i = 0; i < speeds.rows(); ++i) {
      const double t = -region.distances[i] / (sign * speeds(i, target));
      if (!(t > 0) || t >= second) continue;
      if (t < first * (1 - 1e-9)) {
        second = first;
        first = t;
        facet = i;
      } else if (t > first * (1 + 1e-9)) {
        second = t;
      }
    }
    const VectorXd direction = sign * rays.col(target);
    for (int v = 0; v < network_.variables(); ++v) {
      if (network_.boxed[v] && direction[v] != 0) {
        second = std::min(second, ((direction[v] > 0 ? 1 : -1) - z[v]) / direction[v]);
      }
    }
    if (facet < 0 || second <= first || is_queued[static_cast<std::size_t>(facet)]) continue;
    is_queued[static_cast<std::size_t>(facet)] = 1;
    const std::uint64_t pattern = region.pattern ^ key(static_cast<int>(facet));
    if (entered_.count(pattern) > 0 || !queued_.insert(pattern).second) continue;

    const double switched = region.on[static_cast<std::size_t>(facet)] ? -1 : 1;
    VectorXd gradient(static_cast<Eigen::Index>(network_.block.size()));
    for (Eigen::Index c = 0; c < gradient.size(); ++c) {
      const int v = network_.block[static_cast<std::size_t>(c)];
      gradient[c] = switched * region.normals(v, facet) * region.lengths[facet] / network_.scale[v];
    }
    const VectorXd effect = region.effects.col(facet);
    // The Gram matrix of J + effect gradient'.
    const VectorXd& own = by_inputs ? gradient : effect;
    const VectorXd cross =
        by_inputs ? VectorXd(region.jacobian.transpose() * effect + effect.squaredNorm() / 2 * own)
                  : VectorXd(region.jacobian * gradient + gradient.squaredNorm() / 2 * own);
    const MatrixXd next = square + cross * own.transpose() + own * cross.transpose();
    const double estimate = std::sqrt(power_iteration(next, top, 8));
    if (!std::isfinite(second)) second = 2 * first;
    queue_.push({estimate, z + (first + kStepBehind * (second - first)) * direction});
  }
}

}  // namespace swarmcert::lipschitz

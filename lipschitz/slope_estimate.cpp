#include "lipschitz/slope_estimate.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "lipschitz/range.h"
#include "nn/weights/functions.h"
#include "nn/weights/invariants.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using files::Evaluator;

/// Half the distance of the points of a quotient: far above rounding, far below the width of an activation's bend.
constexpr double kHalfStep = 1e-4;
constexpr int kClimbs = 24;
/// Multiplications that all starts together may take.
constexpr double kMostWork = 2e9;

/// x -> rho(phi(x) + s) or one part of NET, in double, with the clamp.
class SampledFunction {
 public:
  /// @param domain as it leaves the clamp.
  SampledFunction(const files::Network& network, const Claim& claim, std::map<std::string, Box> domain)
      : network_(network), domain_(std::move(domain)) {
    const std::vector<std::string> names = files::networks_of(claim.function);
    for (const auto& [name, weights] : files::parts(network))
      evaluators_.emplace(name, Evaluator<double>(*weights));
    first_ = names.front();
    inputs_ = files::inputs(network, claim.function);
    maps_ = files::maps_to_invariants(network, claim.function);
    if (names.size() == 2) last_ = names.back();
    block_ = files::block_coordinates(network, claim.function, claim.block);
    narrow_steps(claim);
    for (const int k : block_)
      scale_.push_back(claim.scale.empty() ? 1.0 : claim.scale[static_cast<std::size_t>(k)]);
    for (const std::string& name : names)
      for (const files::Layer& layer : files::parts(network).at(name)->layers)
        work_ += static_cast<double>(layer.inputs) * layer.outputs;
  }

  Index inputs() const { return inputs_; }
  /// Multiplications of one slope().
  double work() const { return 2 * work_ * static_cast<double>(block_.size() + 1); }

  /// 0, or the middle of the box.
  VectorXd middle() const {
    VectorXd x = VectorXd::Zero(inputs_);
    const auto box = domain_.find(first_);
    for (Index k = 0; box != domain_.end() && k < inputs_; ++k)
      x[k] =
          (box->second.lower[static_cast<std::size_t>(k)] + box->second.upper[static_cast<std::size_t>(k)]) /
          2;
    return x;
  }

  /// A point at one of several scales, inside the box or the clamp where there is one.
  VectorXd random_point(std::mt19937_64& generator) const {
    return random_point_of(first_, inputs_, generator);
  }

  /// Puts other neighbours somewhere, and the ground's input.
  void place_others(std::mt19937_64& generator) {
    if (!last_) return;
    others_ = VectorXd::Zero(files::parts(network_).at(*last_)->inputs());
    std::vector<std::string> kinds;
    for (const auto& [name, weights] : files::parts(network_))
      if (files::is_phi(name) && name != files::kGroundPhi) kinds.push_back(name);
    if (network_.phi.count(files::kGroundKind) == 1 && first_ != files::kGroundPhi)
      add_other(files::kGroundPhi, generator);
    for (std::uint64_t count = kinds.empty() ? 0 : generator() % 3; count > 0; --count)
      add_other(kinds[generator() % kinds.size()], generator);
  }

  /// The steepest quotient around x: along the direction of the largest gain of the Jacobian.
  double slope(const VectorXd& x) const {
    const auto columns = static_cast<Index>(block_.size());
    MatrixXd jacobian;
    for (Index j = 0; j < columns; ++j) {
      const VectorXd column = quotient(x, VectorXd::Unit(columns, j));
      if (j == 0) jacobian.resize(column.size(), columns);
      jacobian.col(j) = column;
    }
    if (columns == 0) return 0;
    VectorXd direction = VectorXd::Ones(columns).normalized();
    for (int i = 0; i < 8; ++i) {
      const VectorXd next = jacobian.transpose() * (jacobian * direction);
      if (!(next.norm() > 0)) return 0;
      direction = next.normalized();
    }
    const double found = quotient(x, direction).norm();
    return std::isfinite(found) ? found : 0;
  }

 private:
  /// In a box points move neither along inputs that it fixes nor, with the room that random_point() leaves, out of it.
  void narrow_steps(const Claim& claim) {
    const auto found = domain_.find(first_);
    if (found == domain_.end()) return;
    Box& box = found->second;
    const auto width = [&box](int k) {
      return box.upper[static_cast<std::size_t>(k)] - box.lower[static_cast<std::size_t>(k)];
    };
    block_.erase(std::remove_if(block_.begin(), block_.end(), [&](int k) { return !(width(k) > 0); }),
                 block_.end());
    const auto scale = [&claim](int k) {
      return claim.scale.empty() ? 1.0 : claim.scale[static_cast<std::size_t>(k)];
    };
    for (const int k : block_) half_step_ = std::min(half_step_, width(k) / (8 * scale(k)));
    for (const int k : block_) {
      box.lower[static_cast<std::size_t>(k)] += half_step_ * scale(k);
      box.upper[static_cast<std::size_t>(k)] -= half_step_ * scale(k);
    }
  }

  static double random_number(std::mt19937_64& generator) {
    return std::ldexp(static_cast<double>(generator() >> 11), -52) - 1;
  }

  VectorXd random_point_of(const std::string& part, Index size, std::mt19937_64& generator) const {
    const double scale = std::exp2(static_cast<double>(generator() % 8) - 4);
    VectorXd x(size);
    const auto box = domain_.find(part);
    const bool is_clamped = network_.clamp && files::is_clamped(part) && !maps_;
    for (Index k = 0; k < size; ++k) {
      const double r = random_number(generator);
      const auto i = static_cast<std::size_t>(k);
      const auto between = [r](double low, double high) { return low + (high - low) * (r + 1) / 2; };
      x[k] = box != domain_.end() ? between(box->second.lower[i], box->second.upper[i])
             : is_clamped         ? between(network_.clamp->lower[i], network_.clamp->upper[i])
                                  : scale * r;
    }
    return x;
  }

  void add_other(const std::string& part, std::mt19937_64& generator) {
    const Index size = files::inputs(network_, files::set_name(files::kind_of(part), files::kind_of(*last_)));
    others_ += term(part, random_point_of(part, size, generator));
  }

  VectorXd evaluated(const std::string& part, const VectorXd& x) const {
    const std::vector<double> y = evaluators_.at(part)(std::vector<double>(x.data(), x.data() + x.size()));
    return VectorXd::Map(y.data(), static_cast<Index>(y.size()));
  }

  VectorXd term(const std::string& part, VectorXd x) const {
    if (maps_) {
      const std::vector<double> seen = files::invariants_of(part, {x.data(), x.data() + x.size()});
      x = VectorXd::Map(seen.data(), static_cast<Index>(seen.size()));
    }
    if (network_.clamp && files::is_clamped(part))
      for (Index k = 0; k < x.size(); ++k)
        x[k] = std::min(std::max(x[k], network_.clamp->lower[static_cast<std::size_t>(k)]),
                        network_.clamp->upper[static_cast<std::size_t>(k)]);
    return evaluated(part, x);
  }

  /// (f(x + h d) - f(x - h d)) / (2 h) for d in the block, in units of the scale.
  VectorXd quotient(const VectorXd& x, const VectorXd& direction) const {
    VectorXd ahead = x, behind = x;
    for (std::size_t j = 0; j < block_.size(); ++j) {
      const double step = half_step_ * scale_[j] * direction[static_cast<Index>(j)];
      ahead[block_[j]] += step;
      behind[block_[j]] -= step;
    }
    VectorXd above = term(first_, ahead), below = term(first_, behind);
    if (last_) {
      above = evaluated(*last_, above + others_);
      below = evaluated(*last_, below + others_);
    }
    return (above - below) / (2 * half_step_);
  }

  const files::Network& network_;
  std::map<std::string, Box> domain_;
  double half_step_ = kHalfStep;
  std::map<std::string, Evaluator<double>> evaluators_;
  std::string first_;
  std::optional<std::string> last_;
  Index inputs_ = 0;
  bool maps_ = false;  ///< to invariants, before the clamp
  std::vector<int> block_;
  std::vector<double> scale_;
  double work_ = 0;
  VectorXd others_;
};

}  // namespace

Estimate slope_estimate(const files::Network& network, const Claim& claim,
                        const SlopeEstimateOptions& options) {
  SampledFunction f(network, claim, clamped(network, options.domain));
  std::mt19937_64 generator(options.seed);
  const double affordable = kMostWork / (f.work() * kClimbs);
  const int starts = std::clamp(static_cast<int>(std::min(affordable, 1e6)), 1, options.starts);
  double steepest = 0;
  for (int start = 0; start < starts && !options.stop.now(); ++start) {
    f.place_others(generator);
    VectorXd x = f.random_point(generator);
    if (start == 0) x = f.middle();  // 0 is where many activations are steepest
    double slope = f.slope(x), share = 1;
    for (int climb = 0; climb < kClimbs && !options.stop.now(); ++climb) {
      const VectorXd moved = x + share * (f.random_point(generator) - x);
      const double there = f.slope(moved);
      if (there > slope) {
        slope = there;
        x = moved;
      } else {
        share *= 0.8;
      }
    }
    steepest = std::max(steepest, slope);
  }
  return Estimate(steepest);
}

}  // namespace swarmcert::lipschitz

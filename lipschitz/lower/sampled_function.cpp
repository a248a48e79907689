#include "lipschitz/lower/sampled_function.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Half the distance of the points of a quotient: much larger than round-off errors, much smaller than the scale on
/// which the slope of an activation varies.
constexpr double kHalfStep = 1e-4;

double random_number(std::mt19937_64& generator) {
  return std::ldexp(static_cast<double>(generator() >> 11), -52) - 1;
}

std::optional<Box> box_in(const Domain& domain, const files::FunctionId& part) {
  const auto found = domain.find(part);
  return found == domain.end() ? std::nullopt : std::optional<Box>(found->second);
}

}  // namespace

SampledFunction::SampledFunction(const files::Network& network, const Claim& claim, Domain domain)
    : network_(network), domain_(std::move(domain)), half_step_(kHalfStep) {
  const std::vector<files::FunctionId> names = claim.function.parts();
  const files::Parts parts = files::parts(network);
  for (const auto& [name, weights] : parts) evaluators_.emplace(name, files::Evaluator<double>(*weights));
  first_ = names.front();
  box_ = box_in(domain_, first_);
  inputs_ = files::inputs(network, claim.function);
  if (names.size() == 2) last_ = names.back();
  for (const auto& [name, weights] : parts)
    if (last_ && claim.neighbours.empty() && name.is_phi() && !name.is_ground_phi())
      other_kinds_.push_back(name);
  block_ = files::block_coordinates(network, claim.function, claim.block);
  narrow_steps(claim);
  for (const int k : block_)
    scale_.push_back(claim.scale.empty() ? 1.0 : claim.scale[static_cast<std::size_t>(k)]);
  for (const files::FunctionId& name : names)
    for (const files::Layer& layer : parts.at(name)->layers)
      work_ += static_cast<double>(layer.inputs) * layer.outputs;
}

void SampledFunction::narrow_steps(const Claim& claim) {
  if (!box_) return;
  Box& box = *box_;
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

std::optional<std::pair<double, double>> SampledFunction::interval(const files::FunctionId& part,
                                                                   const std::optional<Box>& box,
                                                                   Index k) const {
  const auto i = static_cast<std::size_t>(k);
  if (box) return std::pair{box->lower[i], box->upper[i]};
  if (network_.clamp && files::is_clamped(part))
    return std::pair{network_.clamp->lower[i], network_.clamp->upper[i]};
  return std::nullopt;
}

VectorXd SampledFunction::middle() const {
  VectorXd x = VectorXd::Zero(inputs_);
  for (Index k = 0; box_ && k < inputs_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    x[k] = (box_->lower[i] + box_->upper[i]) / 2;
  }
  return x;
}

VectorXd SampledFunction::random_point(std::mt19937_64& generator) const {
  return random_point_of(first_, box_, inputs_, generator);
}

VectorXd SampledFunction::random_point_of(const files::FunctionId& part, const std::optional<Box>& box,
                                          Index size, std::mt19937_64& generator) const {
  const double scale = std::exp2(static_cast<double>(generator() % 8) - 4);
  VectorXd x(size);
  for (Index k = 0; k < size; ++k) {
    const double r = random_number(generator);
    const auto ends = interval(part, box, k);
    x[k] = ends ? ends->first + (ends->second - ends->first) * (r + 1) / 2 : scale * r;
  }
  return x;
}

void SampledFunction::place_others(std::mt19937_64& generator) {
  if (!last_) return;
  constexpr int kTries = 100;  // limited, because a claim may allow only compositions in which NET is silent
  for (int i = 0; i < kTries; ++i) {
    other_networks_.clear();
    others_.clear();
    others_sum_ = VectorXd::Zero(files::parts(network_).at(*last_)->inputs());
    if (network_.phi.count(files::kGroundKind) == 1 && !first_.is_ground_phi())
      add_other(files::FunctionId::ground_phi(), generator);
    for (std::uint64_t count = other_kinds_.empty() ? 0 : generator() % 3; count > 0; --count)
      add_other(other_kinds_[generator() % other_kinds_.size()], generator);
    std::vector<files::FunctionId> all = other_networks_;
    all.push_back(first_);
    is_silent_ = files::is_silent_among(network_, files::FunctionId::set(first_.kind(), last_->kind()), all);
    if (!is_silent_) return;
  }
}

void SampledFunction::add_other(const files::FunctionId& part, std::mt19937_64& generator) {
  const Index size = files::inputs(network_, files::FunctionId::set(part.kind(), last_->kind()));
  other_networks_.push_back(part);
  others_.push_back(random_point_of(part, box_in(domain_, part), size, generator));
  others_sum_ += term(part, others_.back());
}

VectorXd SampledFunction::evaluated(const files::FunctionId& part, const VectorXd& x) const {
  const std::vector<double> y = evaluators_.at(part)(std::vector<double>(x.data(), x.data() + x.size()));
  return VectorXd::Map(y.data(), static_cast<Index>(y.size()));
}

VectorXd SampledFunction::term(const files::FunctionId& part, VectorXd x) const {
  if (network_.clamp && files::is_clamped(part))
    for (Index k = 0; k < x.size(); ++k)
      x[k] = std::min(std::max(x[k], network_.clamp->lower[static_cast<std::size_t>(k)]),
                      network_.clamp->upper[static_cast<std::size_t>(k)]);
  return evaluated(part, x);
}

VectorXd SampledFunction::in_inputs(const VectorXd& direction) const {
  VectorXd all = VectorXd::Zero(inputs_);
  for (std::size_t j = 0; j < block_.size(); ++j)
    all[block_[j]] = scale_[j] * direction[static_cast<Index>(j)];
  return all;
}

VectorXd SampledFunction::quotient(const VectorXd& x, const VectorXd& direction) const {
  if (is_silent_) return VectorXd::Zero(files::parts(network_).at(*last_)->outputs());
  const VectorXd step = half_step_ * in_inputs(direction);
  VectorXd above = term(first_, x + step), below = term(first_, x - step);
  if (last_) {
    above = evaluated(*last_, above + others_sum_);
    below = evaluated(*last_, below + others_sum_);
  }
  return (above - below) / (2 * half_step_);
}

SampledFunction::Steepness SampledFunction::steepest(const VectorXd& x) const {
  const auto columns = static_cast<Index>(block_.size());
  if (columns == 0) return {};
  const int outputs = files::parts(network_).at(last_.value_or(first_))->outputs();
  MatrixXd jacobian(outputs, columns);
  for (Index j = 0; j < columns; ++j) jacobian.col(j) = quotient(x, VectorXd::Unit(columns, j));
  constexpr int kPowers = 100;
  constexpr double kSettled = 1e-9;
  VectorXd direction = VectorXd::Ones(columns).normalized();
  for (int i = 0; i < kPowers; ++i) {
    const VectorXd image = jacobian * direction, next = jacobian.transpose() * image;
    if (!(next.norm() > 0)) return {0, direction};
    const VectorXd before = std::exchange(direction, next.normalized());
    if ((direction - before).norm() < kSettled) break;
  }
  const double found = quotient(x, direction).norm();
  return {std::isfinite(found) ? found : 0, direction};
}

double SampledFunction::width(Index k) const {
  const auto ends = interval(first_, box_, k);
  return ends ? ends->second - ends->first : 1;
}

VectorXd SampledFunction::gradient(const VectorXd& x, const VectorXd& direction) const {
  constexpr double kSteps = 8;  // distance in half steps; over shorter distances the differences are noise
  VectorXd result = VectorXd::Zero(inputs_);
  for (Index k = 0; k < inputs_; ++k) {
    if (!(width(k) > 0)) continue;
    const double length = kSteps * half_step_ / width(k);
    const VectorXd step = length * VectorXd::Unit(inputs_, k);
    const double above = quotient(moved(x, step), direction).norm(),
                 below = quotient(moved(x, -step), direction).norm();
    result[k] = (above - below) / (2 * length);
  }
  return result;
}

VectorXd SampledFunction::moved(const VectorXd& x, const VectorXd& step) const {
  VectorXd result = x;
  for (Index k = 0; k < inputs_; ++k) {
    const auto ends = interval(first_, box_, k);
    result[k] += width(k) * step[k];
    if (ends) result[k] = std::max(ends->first, std::min(result[k], ends->second));
  }
  return result;
}

}  // namespace swarmcert::lipschitz

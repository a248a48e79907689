#include "lipschitz/values/float32_layers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>

#include "nn/arithmetic.h"
#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A bound, with a wide margin, on the relative rounding of a few operations in double.
constexpr double kSafe = 0x1p-40;
/// Half the distance between floats below the normal range.
constexpr double kLeastFloatStep = 0x1p-150;
/// Below the overflow of float32, with room for what is off.
constexpr double kLargest = 0x1p126;

bool is_power_of_two(double x) {
  constexpr std::uint64_t kFraction = 0x000fffffffffffffu;
  return (nn::bits(x) & kFraction) == 0;
}

VectorXd side(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

/// Where the exact input of layer k lies.
Bounds input_bounds(const ReachNetwork& chain, const Reach& reach, std::size_t k) {
  if (k == 0) return {side(reach.box().lower), side(reach.box().upper)};
  Bounds bounds = reach.before_relu(k - 1);
  if (chain[k - 1].has_relu) {
    bounds.lower = bounds.lower.cwiseMax(0.0);
    bounds.upper = bounds.upper.cwiseMax(0.0);
  }
  return bounds;
}

/// Slopes of ReLU over [y - e, y + e]: from 0 where it may be off, up to 1 where it may be on.
void through_relu(const Bounds& bounds, const VectorXd& error, MatrixXd& middle, MatrixXd& radius) {
  for (Index i = 0; i < middle.cols(); ++i) {
    if (bounds.lower(i) - error(i) >= 0) continue;
    if (bounds.upper(i) + error(i) < 0) {
      middle.col(i).setZero();
      radius.col(i).setZero();
      continue;
    }
    const VectorXd least = (middle.col(i) - radius.col(i)).cwiseMin(0.0);
    const VectorXd most = (middle.col(i) + radius.col(i)).cwiseMax(0.0);
    middle.col(i) = (least + most) / 2;
    radius.col(i) = (most - least) * (0.5 + kSafe);
  }
}

/// Where the computed input of layer k lies, which is off by `error` from the exact one in `input`.
Bounds computed_bounds(const ReachNetwork& chain, const Reach& reach, std::size_t k, const Bounds& input,
                       const VectorXd& error) {
  Bounds result{input.lower - error, input.upper + error};
  for (double& x : result.lower) x = down(x);
  for (double& x : result.upper) x = up(x);
  if (k == 0 || !chain[k - 1].has_relu) return result;
  // What is computed behind a ReLU is not negative either, and is zero where the neuron was off in float32 too.
  const VectorXd& y = reach.before_relu(k - 1).upper;
  for (Index j = 0; j < y.size(); ++j)
    if (y(j) + error(j) < 0) result.upper(j) = 0;
  result.lower = result.lower.cwiseMax(0.0);
  return result;
}

/// The exact value of b + w_1 h_1 + ... + w_j h_j for each output, as far as it was added up.
class PartialSums {
 public:
  PartialSums(const ReachLayer& layer, const AffineForms* forms)
      : layer_(layer),
        forms_(forms),
        slack_(sum_rounding(2 * layer.weights.cols() + 1)),
        least_(layer.bias.array() - layer.bias_radius.array()),
        most_(layer.bias.array() + layer.bias_radius.array()),
        size_(layer.bias.cwiseAbs().array() + layer.bias_radius.array()) {
    if (forms == nullptr) return;
    input_sizes_ = forms->centre.cwiseAbs() + forms->deviation();
    slopes_ = Eigen::ArrayXXd::Zero(size_.size(), forms->slopes.cols());
    centre_ = layer.bias;
    radius_ = layer.bias_radius;
    form_size_ = size_;
  }

  void add(Index j, double low, double high) {
    const ArrayXd w = layer_.weights.col(j).array();
    const ArrayXd at_low = w * low, at_high = w * high;
    least_ += at_low.min(at_high);
    most_ += at_low.max(at_high);
    size_ += w.abs() * std::max(std::abs(low), std::abs(high));
    if (forms_ == nullptr) return;
    slopes_ += (w.matrix() * forms_->slopes.row(j)).array();
    centre_ += w * forms_->centre(j);
    radius_ += w.abs() * forms_->radius(j);
    form_size_ += w.abs() * input_sizes_(j);
  }

  /// At least the absolute values. Of two intervals that hold the sum, rounding aside, the sum is in both.
  ArrayXd largest() const {
    if (forms_ == nullptr) return least_.abs().max(most_.abs()) + slack_ * size_;
    const ArrayXd deviation = slopes_.abs().rowwise().sum() + radius_;
    const ArrayXd least = least_.max(centre_ - deviation), most = most_.min(centre_ + deviation);
    return least.abs().max(most.abs()) + slack_ * (size_ + 2 * form_size_);
  }

  /// Of all terms together.
  const ArrayXd& size() const { return size_; }

 private:
  const ReachLayer& layer_;
  const AffineForms* forms_;
  double slack_;  ///< what rounding changes, per unit of the terms' sizes
  ArrayXd least_, most_, size_;
  // Of the forms.
  VectorXd input_sizes_;
  Eigen::ArrayXXd slopes_;
  ArrayXd centre_, radius_, form_size_;
};

}  // namespace

double half_float_step(double size) {
  constexpr std::uint64_t kExponent = 0x7ff0000000000000u;
  const std::uint64_t bits = nn::bits(size) & kExponent;
  double power = 0;
  std::memcpy(&power, &bits, sizeof power);
  return std::max(kFloatUnit * power, kLeastFloatStep);
}

VectorXd layer_rounding(const ReachLayer& layer, const VectorXd& lower, const VectorXd& upper,
                        const AffineForms* forms) {
  PartialSums sums(layer, forms);
  const Index outputs = layer.bias.size();
  ArrayXd error = ArrayXd::Zero(outputs);
  Eigen::Array<bool, Eigen::Dynamic, 1> is_zero = layer.bias.array() == 0 && layer.bias_radius.array() == 0;
  for (Index j = 0; j < lower.size(); ++j) {
    const double largest = std::max(std::abs(lower(j)), std::abs(upper(j)));
    if (largest == 0) continue;
    sums.add(j, lower(j), upper(j));
    const ArrayXd size = sums.largest();
    for (Index i = 0; i < outputs; ++i) {
      const double w = layer.weights(i, j);
      if (w == 0) continue;
      error(i) += is_power_of_two(w) ? kLeastFloatStep : half_float_step((1 + kSafe) * std::abs(w) * largest);
      if (!is_zero(i)) error(i) += half_float_step((1 + kSafe) * (size(i) + error(i)));
      is_zero(i) = false;
    }
  }
  error *= 1 + sum_rounding(2 * lower.size() + 1);
  for (Index i = 0; i < error.size(); ++i)
    if (!(sums.size()(i) + error(i) < kLargest)) error(i) = kInfinity;
  return error.matrix();
}

LayerErrors layer_errors(const ReachNetwork& chain, const Reach& reach, const VectorXd& before) {
  LayerErrors errors;
  VectorXd error = before;
  std::optional<AffineForms> exact;
  if (before.size() <= kMostFormInputs) exact = forms_of(reach.box());
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const Bounds input =
        exact ? within(input_bounds(chain, reach, k), *exact) : input_bounds(chain, reach, k);
    const Bounds computed = computed_bounds(chain, reach, k, input, error);
    std::optional<AffineForms> off = exact;
    if (off) off->radius += (1 + kSafe) * error;
    errors.made.push_back(layer_rounding(chain[k], computed.lower, computed.upper, off ? &*off : nullptr));
    error = (1 + sum_rounding(error.size())) * (chain[k].weights.cwiseAbs() * error) + errors.made.back();
    errors.total.push_back(error);
    if (!exact) continue;
    exact = layer_forms(chain[k], *exact);
    if (chain[k].has_relu) exact = relu_forms(std::move(*exact), reach.before_relu(k));
    if (!exact->all_finite()) exact.reset();
  }
  return errors;
}

std::vector<MatrixXd> sensitivities(const ReachNetwork& chain, const Reach& reach,
                                    const LayerErrors& errors) {
  const Index outputs = chain.back().weights.rows();
  std::vector<MatrixXd> result(chain.size());
  MatrixXd middle = MatrixXd::Identity(outputs, outputs), radius = MatrixXd::Zero(outputs, outputs);
  result.back() = middle;
  for (std::size_t j = chain.size() - 1; j > 0; --j) {
    const MatrixXd size = chain[j].weights.cwiseAbs();
    const double slack = sum_rounding(size.rows());
    radius = ((1 + slack) * radius + slack * middle.cwiseAbs()) * size;
    middle = (middle * chain[j].weights).eval();
    if (chain[j - 1].has_relu) through_relu(reach.before_relu(j - 1), errors.total[j - 1], middle, radius);
    result[j - 1] = (1 + kSafe) * (middle.cwiseAbs() + radius);
  }
  return result;
}

}  // namespace swarmcert::lipschitz

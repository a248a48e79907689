#include "lipschitz/values/float32_layers.h"

#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFloatUnit = 0x1p-24;
/// Far above what rounding in double does to a few operations, relatively to their sizes.
constexpr double kSafe = 0x1p-40;
/// Below the overflow of float32, with room for what is off.
constexpr double kLargest = 0x1p126;

/// The same of a sum of so many terms: (terms - 1) 2^-53 times the sum of their sizes (Higham 2002, section 4.2), and
/// eight times that.
double safe(Index terms) { return kSafe + 0x1p-50 * static_cast<double>(terms); }

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

}  // namespace

VectorXd layer_rounding(const ReachLayer& layer, const VectorXd& lower, const VectorXd& upper) {
  ArrayXd least = layer.bias.array() - layer.bias_radius.array();
  ArrayXd most = layer.bias.array() + layer.bias_radius.array();
  ArrayXd size = layer.bias.cwiseAbs().array() + layer.bias_radius.array();
  ArrayXd error = ArrayXd::Zero(size.size());
  const double slack = safe(2 * lower.size() + 1);
  for (Index j = 0; j < lower.size(); ++j) {
    const double low = lower(j), high = upper(j), largest = std::max(std::abs(low), std::abs(high));
    if (largest == 0) continue;
    const ArrayXd w = layer.weights.col(j).array();
    const ArrayXd at_low = w * low, at_high = w * high;
    least += at_low.min(at_high);
    most += at_low.max(at_high);
    const ArrayXd product = w.abs() * largest;
    size += product;
    error += kFloatUnit * product + 0x1p-150;
    error += kFloatUnit * (least.abs().max(most.abs()) + slack * size + error);
  }
  error *= 1 + slack;
  for (Index i = 0; i < error.size(); ++i)
    if (!(size(i) + error(i) < kLargest)) error(i) = kInfinity;
  return error.matrix();
}

LayerErrors layer_errors(const ReachNetwork& chain, const Reach& reach, const VectorXd& before) {
  LayerErrors errors;
  VectorXd error = before;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const Bounds input = input_bounds(chain, reach, k);
    VectorXd lower = input.lower - error, upper = input.upper + error;
    for (double& x : lower) x = down(x);
    for (double& x : upper) x = up(x);
    if (k > 0 && chain[k - 1].has_relu) {
      // What is computed behind a ReLU is not negative either, and is zero where the neuron was off in float32 too.
      const VectorXd& y = reach.before_relu(k - 1).upper;
      for (Index j = 0; j < upper.size(); ++j)
        if (y(j) + error(j) < 0) upper(j) = 0;
      lower = lower.cwiseMax(0.0);
    }
    errors.made.push_back(layer_rounding(chain[k], lower, upper));
    error = (1 + safe(error.size())) * (chain[k].weights.cwiseAbs() * error) + errors.made.back();
    errors.total.push_back(error);
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
    const double slack = safe(size.rows());
    radius = ((1 + slack) * radius + slack * middle.cwiseAbs()) * size;
    middle = (middle * chain[j].weights).eval();
    if (chain[j - 1].has_relu) through_relu(reach.before_relu(j - 1), errors.total[j - 1], middle, radius);
    result[j - 1] = (1 + kSafe) * (middle.cwiseAbs() + radius);
  }
  return result;
}

}  // namespace swarmcert::lipschitz

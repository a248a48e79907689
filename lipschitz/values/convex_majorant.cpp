#include "lipschitz/values/convex_majorant.h"

#include <cmath>
#include <vector>

#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Room for the rounding of a bound.
constexpr double kWider = 1e-9;

/// n times the last layer of phi.
void scale_last(ReachNetwork& chain, const Box& box, int n) {
  ReachLayer& last = chain.back();
  const bool is_only = chain.size() == 1;
  VectorXd input(last.weights.cols());
  if (is_only) {
    for (Index i = 0; i < input.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      input(i) = std::max(std::abs(box.lower[k]), std::abs(box.upper[k]));
    }
  } else {
    input = Reach(chain, box).before_relu(chain.size() - 2).magnitude();
  }
  last.weights *= n;
  last.bias *= n;
  last.bias_radius *= n;
  // Products with n are off by half a unit of their last place.
  const VectorXd rounding =
      4 * kUnit * (last.weights.cwiseAbs() * input + last.bias.cwiseAbs() + last.bias_radius);
  last.bias_radius += (1 + kWider) * rounding;
  for (double& radius : last.bias_radius) radius = up(radius * (1 + kWider));
}

/// The neurons of a layer of rho in the majorant: U of each, then L of those that are followed below.
struct Doubled {
  std::vector<Index> followed;
  VectorXd shift;  ///< of L, by neuron followed
};

/// Outputs W^+ relu(U) + W^- L, or W^+ L + W^- relu(U) where `swapped`, of a layer behind `before`, which gives relu(U)
/// and L + shift. The bias takes the shift back.
void add_rows(const ReachLayer& layer, const Doubled& before, const std::vector<Index>& outputs, bool swapped,
              Index from, ReachLayer& into) {
  const Index neurons = layer.weights.cols();
  for (std::size_t r = 0; r < outputs.size(); ++r) {
    const Index row = from + static_cast<Index>(r);
    double bias = layer.bias(outputs[r]), size = std::abs(bias);
    for (Index i = 0; i < neurons; ++i) {
      const double weight = layer.weights(outputs[r], i);
      if ((weight > 0) != swapped) into.weights(row, i) = weight;
    }
    for (std::size_t k = 0; k < before.followed.size(); ++k) {
      const double weight = layer.weights(outputs[r], before.followed[k]);
      if ((weight > 0) != swapped) continue;
      into.weights(row, neurons + static_cast<Index>(k)) = weight;
      const double back = weight * before.shift(static_cast<Index>(k));
      bias -= back;
      size += std::abs(back) + std::abs(bias);
    }
    into.bias(row) = bias;
    into.bias_radius(row) = up(layer.bias_radius(outputs[r]) + 4 * kUnit * size + 0x1p-900);
  }
}

std::vector<Index> all_of(const ReachLayer& layer) {
  std::vector<Index> all(static_cast<std::size_t>(layer.bias.size()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Index>(i);
  return all;
}

ReachLayer empty_layer(Index outputs, Index inputs) {
  return {MatrixXd::Zero(outputs, inputs), VectorXd::Zero(outputs), VectorXd::Zero(outputs), true};
}

/// Shifts the L of the last layer of `chain` above zero on the box.
void shift_above_zero(ReachNetwork& chain, const Box& box, Index neurons, Doubled& doubled) {
  chain.back().has_relu = false;
  const Bounds bounds = Reach(chain, box).output();
  ReachLayer& last = chain.back();
  doubled.shift = VectorXd::Zero(static_cast<Index>(doubled.followed.size()));
  for (Index k = 0; k < doubled.shift.size(); ++k) {
    const double lower = bounds.lower(neurons + k);
    double& bias = last.bias(neurons + k);
    doubled.shift(k) = std::max(0.0, -lower) * (1 + kWider) + kWider * std::abs(bias);
    const double rounding = 4 * kUnit * (std::abs(bias) + doubled.shift(k));
    bias += doubled.shift(k);
    double& radius = last.bias_radius(neurons + k);
    radius = up(radius + rounding);
  }
  last.has_relu = true;
}

}  // namespace

ReachNetwork convex_majorant(const ReachNetwork& phi, const Box& box, int n, const ReachNetwork& rho,
                             const Eigen::RowVectorXd& direction, const VectorXd& touched) {
  ReachNetwork chain = phi;
  scale_last(chain, box, n);
  VectorXd h = touched;
  Doubled before;
  for (std::size_t k = 0; k + 1 < rho.size(); ++k) {
    const ReachLayer& layer = rho[k];
    const Index neurons = layer.bias.size();
    h = (layer.weights * h + layer.bias).eval();
    Doubled now;
    for (Index i = 0; i < neurons; ++i)
      if (h(i) > 0) now.followed.push_back(i);
    h = h.cwiseMax(0.0);
    const Index inputs = layer.weights.cols() + static_cast<Index>(before.followed.size());
    ReachLayer next = empty_layer(neurons + static_cast<Index>(now.followed.size()), inputs);
    if (k == 0) {
      // U and L are z itself.
      next.weights << layer.weights, layer.weights(now.followed, Eigen::all);
      next.bias << layer.bias, layer.bias(now.followed);
      next.bias_radius << layer.bias_radius, layer.bias_radius(now.followed);
    } else {
      add_rows(layer, before, all_of(layer), false, 0, next);
      add_rows(layer, before, now.followed, true, neurons, next);
    }
    chain.push_back(std::move(next));
    shift_above_zero(chain, box, neurons, now);
    before = std::move(now);
  }
  ReachLayer top = rho.back();
  top.weights = direction * rho.back().weights;
  top.bias = direction * rho.back().bias;
  top.bias_radius = direction.cwiseAbs() * rho.back().bias_radius;
  if (rho.size() == 1) {
    chain.push_back(top);
  } else {
    ReachLayer last = empty_layer(1, top.weights.cols() + static_cast<Index>(before.followed.size()));
    add_rows(top, before, {0}, false, 0, last);
    chain.push_back(std::move(last));
  }
  chain.back().has_relu = false;
  return chain;
}

}  // namespace swarmcert::lipschitz

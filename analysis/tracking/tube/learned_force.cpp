#include "analysis/tracking/tube/learned_force.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "nn/base/input_error.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"
#include "stability/effects/deep_set_force.h"

namespace swarmcert::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using lipschitz::ReachLayer;
using lipschitz::ReachNetwork;

/// Appends identity layers, which pass on what a ReLU has already let through: relu(I h) = h.
void deepen(ReachNetwork& network, std::size_t depth, const std::string& path) {
  if (network.size() < depth && network.size() < 2) {
    throw files::InputError({path, "", "phi", "", "has networks with and without hidden layers",
                             "a tube needs at least one hidden layer in each"});
  }
  const Index width = network.back().weights.cols();
  while (network.size() < depth) {
    network.insert(network.end() - 1,
                   {MatrixXd::Identity(width, width), VectorXd::Zero(width), VectorXd::Zero(width), true});
  }
}

/// Runs the networks in parallel as one, layer by layer, on the concatenation of their inputs.
ReachNetwork side_by_side(const std::vector<ReachNetwork>& parts) {
  ReachNetwork result;
  for (std::size_t k = 0; k < parts.front().size(); ++k) {
    Index rows = 0;
    Index columns = 0;
    for (const ReachNetwork& part : parts) rows += part[k].weights.rows(), columns += part[k].weights.cols();
    ReachLayer layer{MatrixXd::Zero(rows, columns), VectorXd(rows), VectorXd::Zero(rows),
                     parts.front()[k].has_relu};
    rows = columns = 0;
    for (const ReachNetwork& part : parts) {
      const ReachLayer& own = part[k];
      layer.weights.block(rows, columns, own.weights.rows(), own.weights.cols()) = own.weights;
      layer.bias.segment(rows, own.bias.size()) = own.bias;
      rows += own.weights.rows();
      columns += own.weights.cols();
    }
    result.push_back(std::move(layer));
  }
  return result;
}

/// Replaces the outputs of `parts` networks, `hidden` outputs each, by their sum.
void add_up(ReachLayer& last, Index hidden) {
  const Index parts = last.bias.size() / hidden;
  MatrixXd weights = MatrixXd::Zero(hidden, last.weights.cols());
  VectorXd bias = VectorXd::Zero(hidden);
  VectorXd size = VectorXd::Zero(hidden);
  for (Index p = 0; p < parts; ++p) {
    weights += last.weights.middleRows(p * hidden, hidden);  // exact: nonzero entries do not overlap
    bias += last.bias.segment(p * hidden, hidden);
    size += last.bias.segment(p * hidden, hidden).cwiseAbs();
  }
  last.weights = std::move(weights);
  last.bias = std::move(bias);
  last.bias_radius =
      parts == 1 ? VectorXd(VectorXd::Zero(hidden)) : VectorXd(1e-15 * static_cast<double>(parts) * size);
}

Index component(const std::string& name) {
  const std::vector<std::string> names = {"dp_x_m", "dp_y_m", "dp_z_m", "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"};
  return std::find(names.begin(), names.end(), name) - names.begin();
}

}  // namespace

LearnedForce::LearnedForce(const files::Network& network, const std::string& kind, int neighbours) {
  stability::DeepSetForce(network, kind, {kind});  // rejects networks that cannot be used in flight
  std::vector<std::string> kinds;
  for (const auto& [name, weights] : network.phi)
    if (name != files::kGroundKind) kinds.push_back(name);
  const std::string phi = network.phi.count(kind) == 1 ? kind : kinds.front();
  const std::string rho = network.rho.count(kind) == 1 ? kind : network.rho.begin()->first;
  newton_per_unit_ = network.output_unit == "N" ? 1 : stability::kGramForce_N;
  const int inputs = network.phi.at(phi).inputs();
  std::vector<int> components;  // of (dp, dv), that each input of phi represents
  for (int i = 0; i < inputs; ++i) {
    components.push_back(network.input_order.empty()
                             ? i
                             : static_cast<int>(component(network.input_order[static_cast<std::size_t>(i)])));
  }

  // Orders the inputs as in the state: columns are moved or negated, which is exact.
  ReachNetwork one = lipschitz::reach_network(network.phi.at(phi));
  MatrixXd first = MatrixXd::Zero(one.front().weights.rows(), kPerNeighbour);
  for (int i = 0; i < inputs; ++i)
    first.col(components[static_cast<std::size_t>(i)]) += one.front().weights.col(i);
  one.front().weights = std::move(first);
  std::vector<ReachNetwork> parts(static_cast<std::size_t>(neighbours), one);
  const auto ground = network.phi.find(files::kGroundKind);
  if (ground != network.phi.end()) {
    parts.push_back(lipschitz::reach_network(ground->second));
    parts.back().front().weights *= -1;  // its inputs are -z and -v
  }
  std::size_t depth = 0;
  for (const ReachNetwork& part : parts) depth = std::max(depth, part.size());
  for (ReachNetwork& part : parts) deepen(part, depth, network.path);
  layers_ = side_by_side(parts);
  if (ground == network.phi.end()) {
    MatrixXd& weights = layers_.front().weights;
    weights.conservativeResize(Eigen::NoChange, state_size(neighbours));
    weights.rightCols(kOwnState).setZero();
  }
  add_up(layers_.back(), network.phi.at(phi).outputs());
  for (ReachLayer& layer : lipschitz::reach_network(network.rho.at(rho))) layers_.push_back(std::move(layer));
  const std::vector<files::FunctionId> parts_in_sum(static_cast<std::size_t>(neighbours),
                                                    files::FunctionId::phi(phi));
  if (files::is_silent_among(network, files::FunctionId::set(phi, rho), parts_in_sum)) {
    layers_.back().weights.setZero();
    layers_.back().bias.setZero();
  }

  const auto size = static_cast<std::size_t>(state_size(neighbours));
  clamp_ = {std::vector<double>(size, -kInfinity), std::vector<double>(size, kInfinity)};
  if (!network.clamp) return;
  for (int j = 0; j < neighbours; ++j) {
    for (int i = 0; i < inputs; ++i) {
      const auto at = static_cast<std::size_t>(j * kPerNeighbour + components[static_cast<std::size_t>(i)]);
      clamp_.lower[at] = network.clamp->lower[static_cast<std::size_t>(i)];
      clamp_.upper[at] = network.clamp->upper[static_cast<std::size_t>(i)];
    }
  }
}

lipschitz::Box LearnedForce::clamped(const lipschitz::Box& box) const {
  lipschitz::Box result = box;
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    result.lower[k] = std::clamp(box.lower[k], clamp_.lower[k], clamp_.upper[k]);
    result.upper[k] = std::clamp(box.upper[k], clamp_.lower[k], clamp_.upper[k]);
  }
  return result;
}

LearnedForce::Forms LearnedForce::over(const lipschitz::Box& box, const Forms* around) const {
  const lipschitz::Box inner = clamped(box);
  Forms forms;
  forms.reach = std::make_shared<const lipschitz::Reach>(layers_, inner,
                                                         around != nullptr ? around->reach.get() : nullptr);
  MatrixXd directions(2, 1);
  directions << 1, -1;
  const lipschitz::LinearForms both = forms.reach->upper_forms(directions);
  Eigen::Matrix<double, 2, 1> constants = both.constants;
  MatrixXd rows = both.rows;
  VectorXd size = constants.cwiseAbs();
  for (Index k = 0; k < rows.cols(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double largest = std::max(std::abs(inner.lower[at]), std::abs(inner.upper[at]));
    for (Index r = 0; r < 2; ++r) size(r) += std::abs(rows(r, k)) * largest;
    if (inner.lower[at] == box.lower[at] && inner.upper[at] == box.upper[at]) continue;
    // Beyond the clamp the input is constant, so the maximum of the form along this input is a constant.
    for (Index r = 0; r < 2; ++r) {
      constants(r) += std::max(rows(r, k) * inner.lower[at], rows(r, k) * inner.upper[at]);
      rows(r, k) = 0;
    }
  }
  // Covers about a dozen roundings of the constant, and one of each coefficient by the unit.
  constants += 1e-14 * size;
  forms.upper_row = newton_per_unit_ * rows.row(0).transpose();
  forms.lower_row = newton_per_unit_ * rows.row(1).transpose();
  forms.upper = newton_per_unit_ * (constants(0) + 1e-15 * size(0));
  forms.lower = newton_per_unit_ * (constants(1) + 1e-15 * size(1));
  if (std::isnan(forms.upper) || !forms.upper_row.allFinite())
    forms.upper = kInfinity, forms.upper_row.setZero();
  if (std::isnan(forms.lower) || !forms.lower_row.allFinite())
    forms.lower = kInfinity, forms.lower_row.setZero();
  return forms;
}

double LearnedForce::roughly(const VectorXd& state) const {
  VectorXd x = state;
  for (Index k = 0; k < x.size(); ++k)
    x(k) = std::clamp(x(k), clamp_.lower[static_cast<std::size_t>(k)],
                      clamp_.upper[static_cast<std::size_t>(k)]);
  return newton_per_unit_ * lipschitz::evaluate_roughly(layers_, x)(0);
}

}  // namespace swarmcert::analysis

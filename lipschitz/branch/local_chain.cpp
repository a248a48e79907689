#include "lipschitz/branch/local_chain.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>

#include "lipschitz/solver/lipsdp_solver.h"

namespace swarmcert::lipschitz {

using Eigen::Index;
using Eigen::MatrixXd;

Index LocalChain::neurons() const {
  Index count = 0;
  for (const ReachLayer& layer : hidden) count += layer.weights.rows();
  return count;
}

double LocalChain::unscaled_rho(double rho) const { return std::ldexp(rho, 2 * output_exponent); }

double LocalChain::unscaled_multiplier(double t, std::size_t layer) const {
  return std::ldexp(t, 2 * (output_exponent - exponents[layer]));
}

double LocalChain::scaled_multiplier(double t, std::size_t layer) const {
  return std::ldexp(t, 2 * (exponents[layer] - output_exponent));
}

std::size_t LocalChain::layer_of(Index neuron) const {
  std::size_t layer = 0;
  for (; neuron >= hidden[layer].weights.rows(); ++layer) neuron -= hidden[layer].weights.rows();
  return layer;
}

check::Conflict LocalChain::unscaled(const NeuronPair& pair, double multiplier) const {
  const int first = exponents[layer_of(pair.first)], second = exponents[layer_of(pair.second)];
  // The condition is lambda y_1 2^-first + (1 - lambda) y_2 2^-second, up to a positive factor.
  const double one = std::ldexp(pair.lambda, second - first);
  return {static_cast<std::size_t>(pair.first),
          static_cast<std::size_t>(pair.second),
          pair.first_on,
          pair.second_on,
          one / (one + (1 - pair.lambda)),
          std::ldexp(multiplier, 2 * output_exponent - first - second)};
}

double LocalChain::squared_slope(const Eigen::VectorXd& x) const {
  Eigen::VectorXd h = x;
  MatrixXd jacobian = MatrixXd::Zero(inputs(), static_cast<Index>(block.size()));
  for (std::size_t k = 0; k < block.size(); ++k) jacobian(block[k], static_cast<Index>(k)) = weight[k];
  for (const ReachLayer& layer : hidden) {
    h = (layer.weights * h + layer.bias).eval();
    jacobian = (layer.weights * jacobian).eval();
    if (!layer.has_relu) continue;
    for (Index i = 0; i < h.size(); ++i)
      if (!(h(i) > 0)) jacobian.row(i).setZero();
    h = h.cwiseMax(0.0);
  }
  const MatrixXd square = jacobian.transpose() * gram * jacobian;
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(square, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

LocalChain local_chain(const ReachNetwork& layers, const MatrixXd& form, const std::vector<int>& block,
                       const std::vector<double>& weight) {
  LocalChain chain;
  chain.hidden.assign(layers.begin(), layers.end() - 1);
  chain.block = block;
  if (chain.block.empty()) {
    chain.block.resize(static_cast<std::size_t>(chain.inputs()));
    std::iota(chain.block.begin(), chain.block.end(), 0);
  }
  chain.weight = weight;
  if (chain.weight.empty()) chain.weight.assign(chain.block.size(), 1.0);
  const MatrixXd& last = layers.back().weights;
  chain.gram =
      form.size() == 0 ? MatrixXd(last.transpose() * last) : MatrixXd(last.transpose() * form * last);

  // Stages are separated by ReLUs: a layer without ReLU is multiplied by the next one and is not scaled.
  ReluChain stages = {MatrixXd::Zero(chain.inputs(), static_cast<Index>(chain.block.size()))};
  for (std::size_t k = 0; k < chain.weight.size(); ++k)
    stages.front()(chain.block[k], static_cast<Index>(k)) = chain.weight[k];
  bool joins = true;
  for (const ReachLayer& layer : chain.hidden) {
    if (joins) {
      stages.back() = (layer.weights * stages.back()).eval();
    } else {
      stages.push_back(layer.weights);
    }
    joins = !layer.has_relu;
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(chain.gram);
  stages.emplace_back(eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
                      eigen.eigenvectors().transpose());
  const std::vector<int> exponents = balancing_exponents(stages);
  int total = 0;
  std::size_t stage = 0;
  for (ReachLayer& layer : chain.hidden) {
    const int own = layer.has_relu ? exponents[stage++] : 0;
    layer.weights *= std::ldexp(1.0, -own);
    total += own;
    layer.bias *= std::ldexp(1.0, -total);
    layer.bias_radius *= std::ldexp(1.0, -total);
    chain.exponents.push_back(total);
    chain.without_relu.push_back(layer.has_relu ? 0 : layer.weights.rows());
  }
  chain.gram *= std::ldexp(1.0, -2 * exponents.back());
  chain.output_exponent = total + exponents.back();
  return chain;
}

std::vector<SlopeLayer> slope_layers(const LocalChain& chain, const std::vector<NeuronState>& states) {
  std::vector<SlopeLayer> layers;
  std::size_t neuron = 0;
  for (const auto& hidden : chain.hidden) {
    const Index rows = hidden.weights.rows();
    layers.push_back({hidden.weights, Eigen::VectorXd::Zero(rows), Eigen::VectorXd::Zero(rows)});
    for (Index i = 0; i < rows; ++i, ++neuron) {
      layers.back().low(i) = states[neuron] == NeuronState::kOn ? 1 : 0;
      layers.back().width(i) = states[neuron] == NeuronState::kUndecided ? 1 : 0;
    }
  }
  MatrixXd& first = layers.front().weights;
  first = MatrixXd(first(Eigen::all, chain.block));
  for (Index k = 0; k < first.cols(); ++k) first.col(k) *= chain.weight[static_cast<std::size_t>(k)];
  return layers;
}

SetChain set_chain(const LocalChain& whole, std::size_t last) {
  SetChain set{whole, whole, whole, whole.hidden.at(last).weights};
  const auto cut = static_cast<std::ptrdiff_t>(last);
  const auto part = [&](LocalChain& chain, std::ptrdiff_t from, std::ptrdiff_t to) {
    chain.hidden = ReachNetwork(whole.hidden.begin() + from, whole.hidden.begin() + to);
    chain.exponents = std::vector<int>(whole.exponents.begin() + from, whole.exponents.begin() + to);
    chain.without_relu =
        std::vector<Index>(whole.without_relu.begin() + from, whole.without_relu.begin() + to);
  };
  part(set.phi, 0, cut);
  part(set.rho, cut + 1, static_cast<std::ptrdiff_t>(whole.hidden.size()));
  set.phi.gram.resize(0, 0);
  set.rho.block.resize(static_cast<std::size_t>(set.last.rows()));
  std::iota(set.rho.block.begin(), set.rho.block.end(), 0);
  set.rho.weight.assign(set.rho.block.size(), 1.0);
  return set;
}

int SetChain::form_exponent() const {
  return 2 * (whole.output_exponent - whole.exponents.at(phi.hidden.size()));
}

LocalChain homogeneous(LocalChain chain) {
  for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
    ReachLayer& layer = chain.hidden[k];
    const bool is_last = k + 1 == chain.hidden.size();
    const Index rows = layer.weights.rows(), columns = layer.weights.cols();
    MatrixXd wider = MatrixXd::Zero(rows + (is_last ? 0 : 1), columns + 1);
    wider.topLeftCorner(rows, columns) = layer.weights;
    wider.col(columns).head(rows) = layer.bias;
    if (!is_last) wider(rows, columns) = 1;
    if (!is_last) chain.without_relu[k] = 1;
    layer.weights = std::move(wider);
    layer.bias = layer.bias_radius = Eigen::VectorXd::Zero(layer.weights.rows());
  }
  return chain;
}

}  // namespace swarmcert::lipschitz

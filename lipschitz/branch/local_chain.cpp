#include "lipschitz/branch/local_chain.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>

#include "lipschitz/lipsdp_solver.h"

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

double LocalChain::squared_slope(const Eigen::VectorXd& x) const {
  Eigen::VectorXd h = x;
  MatrixXd jacobian = MatrixXd::Zero(inputs(), static_cast<Index>(block.size()));
  for (std::size_t k = 0; k < block.size(); ++k) jacobian(block[k], static_cast<Index>(k)) = weight[k];
  for (const ReachLayer& layer : hidden) {
    h = (layer.weights * h + layer.bias).eval();
    jacobian = (layer.weights * jacobian).eval();
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

  ReluChain stages;
  for (const ReachLayer& layer : chain.hidden) stages.push_back(layer.weights);
  stages.front() = MatrixXd(stages.front()(Eigen::all, chain.block));
  for (std::size_t k = 0; k < chain.weight.size(); ++k)
    stages.front().col(static_cast<Index>(k)) *= chain.weight[k];
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(chain.gram);
  stages.emplace_back(eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
                      eigen.eigenvectors().transpose());
  const std::vector<int> exponents = balancing_exponents(stages);
  int total = 0;
  for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
    chain.hidden[k].weights *= std::ldexp(1.0, -exponents[k]);
    total += exponents[k];
    chain.hidden[k].bias *= std::ldexp(1.0, -total);
    chain.hidden[k].bias_radius *= std::ldexp(1.0, -total);
    chain.exponents.push_back(total);
  }
  chain.gram *= std::ldexp(1.0, -2 * exponents.back());
  chain.output_exponent = total + exponents.back();
  return chain;
}

}  // namespace swarmcert::lipschitz

#include "lipschitz/upper/spectral_norm.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "lipschitz/base/rounding.h"
#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/witness.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

mpq_class squared_norm(const check::Matrix& m) {
  check::Dyadic sum;
  for (const check::Dyadic& x : m.entries) sum += x * x;
  mpq_class result(sum.mantissa);
  if (sum.exponent < 0) return result >> static_cast<mp_bitcnt_t>(-sum.exponent);
  return result << static_cast<mp_bitcnt_t>(sum.exponent);
}

/// Returns sqrt(|W v|^2 / |v|^2), rounded down; v must not be zero.
LowerBound rayleigh_root(const files::Layer& layer, const std::vector<double>& v) {
  const check::Matrix w(layer.outputs, layer.inputs, layer.weights);
  const check::Matrix column(layer.inputs, 1, v);
  return LowerBound(sqrt_down(squared_norm(check::product(w, column)) / squared_norm(column)));
}

}  // namespace

SpectralNorm spectral_norm(const files::Layer& layer, std::optional<double> limit) {
  for (const double weight : layer.weights) {
    if (!std::isfinite(weight))
      throw std::invalid_argument("spectral_norm: " + layer.name + " has a non-finite weight");
  }
  Eigen::MatrixXd w = Eigen::Map<const RowMajor>(layer.weights.data(), layer.outputs, layer.inputs);
  // Scales the weights to order one, because squares of very large or small weights would leave the range of double.
  const double magnitude = w.cwiseAbs().maxCoeff();
  // At least -1000, because 2^1000 is still a double.
  const int exponent = magnitude > 0 ? std::max(std::ilogb(magnitude), -1000) : 0;
  w *= std::ldexp(1.0, -exponent);

  const bool wide = w.cols() > w.rows();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(wide ? Eigen::MatrixXd(w * w.transpose())
                                                                  : Eigen::MatrixXd(w.transpose() * w));
  const double estimate = std::max(0.0, eigen.eigenvalues().maxCoeff());
  Eigen::VectorXd v = eigen.eigenvectors().rightCols<1>();
  if (wide) v = w.transpose() * v;
  if (!(v.norm() > 0)) v = Eigen::VectorXd::Unit(w.cols(), 0);
  v.normalize();

  SpectralNorm result;
  result.lower_vector.assign(v.data(), v.data() + v.size());
  const LowerBound lower = rayleigh_root(layer, result.lower_vector);

  // Tries rho from the estimate, then increasing values until the proof succeeds. For a zero matrix, the smallest rho
  // is sufficient.
  std::vector<double> candidates;
  const double in_units = std::ldexp(estimate, 2 * exponent);
  if (limit && std::abs(*limit * *limit - in_units) < 1e-9 * in_units) candidates.push_back(*limit * *limit);
  for (double slack = 0x1p-52 * static_cast<double>(4 + std::min(w.rows(), w.cols())); slack < 1;
       slack *= 2) {
    candidates.push_back(std::max(in_units * (1 + slack), std::numeric_limits<double>::min()));
  }
  const std::vector<check::Matrix> stage = {check::Matrix(layer.outputs, layer.inputs, layer.weights)};
  for (const double rho : candidates) {
    std::optional<UpperProof> proof = prove(stage, rho, {});
    if (!proof) continue;
    result.upper_proof = std::move(*proof);
    result.norm = {lower, result.upper_proof.upper};
    return result;
  }
  throw std::runtime_error("spectral_norm: no proof found for layer " + layer.name);
}

void require_moderate(const files::Network& network) {
  const auto refuse = [](const files::Weights& weights, const std::string& field, double value) {
    std::ostringstream text;
    text << value;
    throw files::InputError(
        {weights.path, "", field, text.str(),
         "is too large: squares of slopes would leave the range of double",
         "scale the network so that weights, biases and the product of its layers stay below 1e150"});
  };
  constexpr double kMost = 1e150;
  for (const auto& [part, weights] : files::parts(network)) {
    double product = 1;
    for (const files::Layer& layer : weights->layers) {
      double largest = 0, bias = 0;
      for (const double weight : layer.weights) largest = std::max(largest, std::abs(weight));
      for (const double one : layer.biases) bias = std::max(bias, std::abs(one));
      if (!(largest <= kMost)) refuse(*weights, layer.name + ".weight", largest);
      if (!(bias <= kMost)) refuse(*weights, layer.name + ".bias", bias);
      // An upper bound on the spectral norm. Norms below 1 do not compensate for large ones.
      product *= std::max(1.0, largest * std::sqrt(static_cast<double>(layer.outputs) * layer.inputs));
      if (!(product <= kMost)) refuse(*weights, layer.name + ".weight", largest);
    }
  }
}

UpperBound product_up(const std::vector<UpperBound>& factors) {
  check::Dyadic exact(1.0);
  for (const UpperBound factor : factors) exact = exact * check::Dyadic(factor.value());
  return UpperBound(rounded_up(exact));
}

}  // namespace swarmcert::lipschitz

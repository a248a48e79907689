#include "lipschitz/upper/comparison.h"

#include <Eigen/Core>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>

#include "lipschitz/base/rounding.h"
#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/live_chain.h"
#include "lipschitz/upper/sdp_bound.h"
#include "nn/base/random.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double largest_singular_value(const MatrixXd& m) { return Eigen::JacobiSVD<MatrixXd>(m).singularValues()(0); }

constexpr int kFloorStarts = 24;

using Pattern = std::vector<VectorXd>;

/// Returns M_k D_{k-1} ... D_1 M_1 for each k, in ascending order.
std::vector<MatrixXd> partial_products(const std::vector<MatrixXd>& chain, const Pattern& pattern) {
  std::vector<MatrixXd> result = {chain[0]};
  for (std::size_t k = 1; k < chain.size(); ++k)
    result.push_back(chain[k] * (pattern[k - 1].asDiagonal() * result.back()));
  return result;
}

/// Increases the norm of the product by choosing every D_k for the current singular directions until nothing changes.
double alternate(const std::vector<MatrixXd>& chain, Pattern& pattern) {
  double best = 0;
  for (int round = 0; round < 100; ++round) {
    const std::vector<MatrixXd> forward = partial_products(chain, pattern);
    const Eigen::JacobiSVD<MatrixXd> svd(forward.back(), Eigen::ComputeThinU | Eigen::ComputeThinV);
    const double slope = svd.singularValues()(0);
    if (!(slope > best * (1 + 1e-12))) return std::max(best, slope);
    best = slope;
    VectorXd backward = svd.matrixU().col(0);
    for (std::size_t k = chain.size() - 1; k > 0; --k) {
      backward = chain[k].transpose() * backward;
      const VectorXd value = forward[k - 1] * svd.matrixV().col(0);
      pattern[k - 1] = (backward.array() * value.array() > 0).cast<double>();
      backward = pattern[k - 1].cwiseProduct(backward);
    }
  }
  return best;
}

/// Tries to flip each neuron once; returns whether a flip increased `slope`.
bool flip(const std::vector<MatrixXd>& chain, Pattern& pattern, double& slope, const Stop& stop) {
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    for (Index i = 0; i < pattern[k].size(); ++i) {
      if (stop.now()) return false;
      const std::vector<MatrixXd> forward = partial_products(chain, pattern);
      MatrixXd behind = chain[k + 1].col(i);
      for (std::size_t j = k + 1; j < pattern.size(); ++j)
        behind = chain[j + 1] * (pattern[j].asDiagonal() * behind);
      const double sign = pattern[k](i) > 0 ? -1 : 1;
      const double flipped = largest_singular_value(forward.back() + sign * behind * forward[k].row(i));
      if (flipped > slope * (1 + 1e-9)) {
        pattern[k](i) = 1 - pattern[k](i);
        slope = flipped;
        return true;
      }
    }
  }
  return false;
}

std::vector<std::string> stage_names(const files::Network& network, const files::FunctionId& function) {
  const auto parts = files::parts(network);
  const std::vector<files::FunctionId> names = function.parts();
  std::vector<std::string> result;
  for (const files::Layer& layer : parts.at(names[0])->layers) result.push_back(layer.name);
  if (names.size() == 1) return result;
  bool is_first = true;
  for (std::string& name : result) name += " of phi";
  for (const files::Layer& layer : parts.at(names[1])->layers) {
    if (is_first) {
      result.back() += " with " + layer.name + " of rho";
    } else {
      result.push_back(layer.name + " of rho");
    }
    is_first = false;
  }
  return result;
}

}  // namespace

std::optional<UpperBound> combettes_pesquet(const std::vector<check::Matrix>& stages, const Stop& stop) {
  std::vector<check::Dyadic> c = {1.0};
  for (std::size_t j = 1; j <= stages.size(); ++j) {
    check::Dyadic sum;
    check::Matrix product = stages[j - 1];
    for (std::size_t i = j; i-- > 0;) {  // product is M_j ... M_{i+1}
      if (stop.now()) return std::nullopt;
      const SdpBound norm = sdp_bound({product});
      if (!norm.proof) return std::nullopt;
      sum += c[i] * check::Dyadic(norm.proof->upper.value());
      if (i > 0) product = check::product(product, stages[i - 1]);
    }
    c.push_back(sum);
  }
  check::Dyadic exact = c.back();
  exact.exponent -= static_cast<long>(stages.size()) - 1;
  return UpperBound(rounded_up(exact));
}

PatternFloor pattern_floor(const std::vector<check::Matrix>& stages, int starts, std::uint64_t seed,
                           const Stop& stop) {
  const std::vector<MatrixXd> chain = rounded(stages);
  files::Random random(seed);
  Pattern best(chain.size() - 1);
  double slope = -1;
  for (int start = 0; start < std::max(starts, 1) && (start == 0 || !stop.now()); ++start) {
    Pattern pattern;
    for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
      VectorXd on(chain[k].rows());
      for (double& entry : on) entry = start == 0 || random.uniform() < 0.5 ? 1.0 : 0.0;
      pattern.push_back(on);
    }
    const double found = alternate(chain, pattern);
    if (found > slope) slope = found, best = pattern;
  }
  for (int flips = 0; flips < 200 && flip(chain, best, slope, stop); ++flips)
    slope = std::max(slope, alternate(chain, best));

  PatternFloor result;
  const std::vector<MatrixXd> forward = partial_products(chain, best);
  const Eigen::JacobiSVD<MatrixXd> svd(forward.back(), Eigen::ComputeThinV);
  result.slope = Estimate(svd.singularValues()(0));
  VectorXd z = svd.matrixV().col(0);
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const VectorXd y = chain[k] * z;
    result.gains.push_back(z.norm() > 0 ? y.norm() / z.norm() : 0);
    if (k + 1 == chain.size()) break;
    z = best[k].cwiseProduct(y);
    result.relu_gains.push_back(y.norm() > 0 ? z.norm() / y.norm() : 0);
  }
  return result;
}

Comparison compare(const files::Network& network, const files::FunctionId& function, const std::string& block,
                   const std::vector<double>& scale, const Stop& stop) {
  const std::vector<check::Matrix> stages = check::stages(network, function, block, scale);
  Comparison result;
  result.combettes_pesquet = combettes_pesquet(stages, stop);
  result.eclipse_fast = eclipse_fast(stages);
  result.floor = pattern_floor(stages, kFloorStarts, 1, stop);
  const std::vector<std::string> names = stage_names(network, function);
  const std::vector<MatrixXd> chain = rounded(stages);
  for (std::size_t k = 0; k < chain.size(); ++k)
    result.stages.push_back({names[k], largest_singular_value(chain[k]), result.floor.gains[k]});
  return result;
}

}  // namespace swarmcert::lipschitz

#include "lipschitz/upper/bent_bound.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "lipschitz/solver/chain_newton.h"
#include "lipschitz/solver/dense_kernels.h"
#include "lipschitz/solver/node_inequality.h"
#include "lipschitz/upper/live_chain.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The chain scaled to stages of norm about one: M_k = stages[k] 2^exponents[k], hidden ones with their slopes.
struct ScaledBentChain {
  std::vector<SlopeLayer> hidden;
  MatrixXd last;
  std::vector<int> exponents;
  Index variables = 0;  ///< inputs, and neurons that have more than one slope
};

bool is_grouped(const check::BentChain& chain) {
  return std::any_of(chain.groups.begin(), chain.groups.end(), [](int group) { return group > 1; });
}

double norm_of(const MatrixXd& m) { return std::sqrt(largest_eigenvalue(m * m.transpose())); }

/// Returns the largest |slope| of the neurons of a layer.
double steepest(const SlopeLayer& layer) {
  return (layer.low + layer.width).cwiseAbs().cwiseMax(layer.low.cwiseAbs()).maxCoeff();
}

/// Returns an orthogonal matrix whose first row is constant.
MatrixXd helmert(Index size) {
  MatrixXd q = MatrixXd::Zero(size, size);
  q.row(0).setConstant(1 / std::sqrt(static_cast<double>(size)));
  for (Index i = 1; i < size; ++i) {
    q.row(i).head(i).setConstant(1 / std::sqrt(static_cast<double>(i * (i + 1))));
    q(i, i) = -static_cast<double>(i) * q(i, 0);
  }
  return q;
}

/// Turns each group of a layer: its first number becomes the sum, which passes unchanged, and the others are not longer
/// than what enters them.
void turn_groups(SlopeLayer& layer, MatrixXd& next) {
  const MatrixXd q = helmert(layer.group);
  for (Index first = 0; first < layer.weights.rows(); first += layer.group) {
    layer.weights.middleRows(first, layer.group) = q * layer.weights.middleRows(first, layer.group).eval();
    next.middleCols(first, layer.group) = next.middleCols(first, layer.group).eval() * q.transpose();
    layer.low(first) = 1;
    layer.width(first) = 0;
  }
}

/// Returns the live neurons of hidden layer k with their slopes.
SlopeLayer slope_layer(const check::BentChain& chain, const LiveChain& live, std::size_t k,
                       std::size_t before) {
  const std::vector<Index>& neurons = live.neurons()[k];
  SlopeLayer layer{live.live()[k], VectorXd(static_cast<Index>(neurons.size())), {}};
  layer.width = layer.low;
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    const check::SlopeRange& range = chain.slopes[before + static_cast<std::size_t>(neurons[i])];
    layer.low(static_cast<Index>(i)) = to_double(range.low);
    layer.width(static_cast<Index>(i)) = to_double(range.high - range.low);
  }
  if (!chain.groups.empty()) layer.group = chain.groups[k];
  return layer;
}

ScaledBentChain scaled_to_one(const check::BentChain& chain, const LiveChain& live) {
  ScaledBentChain result;
  std::size_t before = 0;
  for (std::size_t k = 0; k < live.neurons().size(); ++k) {
    result.hidden.push_back(slope_layer(chain, live, k, before));
    before += static_cast<std::size_t>(chain.stages[k].rows);
  }
  result.last = live.live().back();
  const auto stage = [&result](std::size_t k) -> MatrixXd& {
    return k < result.hidden.size() ? result.hidden[k].weights : result.last;
  };
  for (std::size_t k = 0; k < result.hidden.size(); ++k)
    if (result.hidden[k].group > 1) turn_groups(result.hidden[k], stage(k + 1));
  MatrixXd& first = stage(0);
  if (first.cols() > first.rows()) {  // an orthogonal change of inputs drops the null space
    const Eigen::HouseholderQR<MatrixXd> qr(first.transpose());
    const MatrixXd r = qr.matrixQR().topRows(first.rows()).triangularView<Eigen::Upper>();
    first = r.transpose();
  }
  result.variables = first.cols();
  for (std::size_t k = 0; k <= result.hidden.size(); ++k) {
    const bool is_hidden = k < result.hidden.size();
    const double norm = norm_of(stage(k)) * (is_hidden ? steepest(result.hidden[k]) : 1.0);
    result.exponents.push_back(
        norm > 0 && std::isfinite(norm) ? static_cast<int>(std::lround(std::log2(norm))) : 0);
    stage(k) *= std::ldexp(1.0, -result.exponents.back());
    if (is_hidden) result.variables += (result.hidden[k].width.array() > 0).count();
  }
  return result;
}

/// Returns multipliers that prove the product of norms with a margin. With weights l_k of |dz_k|^2, computed backwards
/// as l_{k-1} = 2 l_k max c^2 |M_k|^2, where c is the steepest slope of a neuron, the multiplier is t = l_k c / (b -
/// a), for which l_k z^2 + 2 t (z - a y) (b y - z) is at most l_k c^2 y^2. In the variables w the multiplier is t (b -
/// a).
VectorXd product_start(const ScaledBentChain& chain) {
  constexpr double kInside = 2;
  std::vector<double> backwards;
  const double last = norm_of(chain.last);
  double weight = kInside * last * last;
  for (std::size_t k = chain.hidden.size(); k-- > 0;) {
    const SlopeLayer& layer = chain.hidden[k];
    for (Index i = layer.low.size(); i-- > 0;)
      if (layer.width(i) > 0)
        backwards.push_back(weight *
                            std::fmax(std::fabs(layer.low(i)), std::fabs(layer.low(i) + layer.width(i))));
    const double c = steepest(layer), norm = norm_of(layer.weights);
    weight *= kInside * c * c * norm * norm;
  }
  backwards.push_back(weight);
  return Eigen::Map<const VectorXd>(backwards.data(), static_cast<Index>(backwards.size())).reverse();
}

/// Returns c of each layer if all neurons of a layer have the same range [1 - c, c], as is the case for all inputs.
std::optional<std::vector<double>> slopes_of_layers(const ScaledBentChain& chain) {
  std::vector<double> result;
  for (const SlopeLayer& layer : chain.hidden) {
    const double low = layer.low(0), width = layer.width(0);
    const bool is_one = (layer.low.array() == low).all() && (layer.width.array() == width).all();
    if (!is_one || low > 0 || width != 1 - 2 * low) return std::nullopt;
    result.push_back(1 - low);
  }
  return result;
}

/// Solves by blocks if that is faster, else as a dense program; returns nothing if that is too large.
std::optional<InteriorPointResult> minimise(const ScaledBentChain& chain,
                                            const InteriorPointOptions& options) {
  if (const std::optional<std::vector<double>> slopes = slopes_of_layers(chain)) {
    ReluChain stages;
    for (const SlopeLayer& layer : chain.hidden) stages.push_back(layer.weights);
    stages.push_back(chain.last);
    std::optional<InteriorPointResult> found = minimise_long_chain(ChainSlack(stages, *slopes), options);
    if (found) {
      for (VectorXd& y : found->points) {  // converts to multipliers in w
        Index next = 1;
        for (const SlopeLayer& layer : chain.hidden) {
          y.segment(next, layer.width.size()).array() *= layer.width.array();
          next += layer.width.size();
        }
      }
      return found;
    }
  } else if (chain.variables > kMostBentVariables) {
    return std::nullopt;
  }
  const NodeInequality inequality(chain.hidden, chain.last.transpose() * chain.last);
  return minimise(inequality, product_start(chain), options);
}

/// Converts to the units of the original chain: rho, then the multipliers of neurons, or of groups and their sums, for
/// which 0 stands here.
VectorXd unscaled(const ScaledBentChain& chain, const VectorXd& y) {
  int total = 0, up_to = 0;
  for (const int e : chain.exponents) total += e;
  std::vector<double> result = {std::ldexp(y(0), 2 * total)};
  Index next = 1;
  for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
    const SlopeLayer& layer = chain.hidden[k];
    up_to += chain.exponents[k];
    for (Index i = 0; i < layer.width.size(); ++i) {
      if (!(layer.width(i) > 0)) continue;
      if (i % layer.group <= 1) result.push_back(std::ldexp(y(next), 2 * (total - up_to)) / layer.width(i));
      ++next;
    }
    if (layer.group > 1)
      result.resize(result.size() + static_cast<std::size_t>(layer.width.size() / layer.group));
  }
  return Eigen::Map<const VectorXd>(result.data(), static_cast<Index>(result.size()));
}

/// Sets the multipliers of sums so large, beside those of their layer, that a deviation of the sums, which the solver
/// has eliminated, costs no more than `slack` of rho.
void set_multipliers_of_sums(const check::BentChain& chain, double slack, std::vector<double>& t) {
  constexpr double kBeside = 64;
  auto next = t.begin();
  for (std::size_t k = 0; k < chain.groups.size(); ++k) {
    const int rows = chain.stages[k].rows, count = rows / chain.groups[k];
    if (chain.groups[k] > 1)
      std::fill_n(next + count, count, kBeside / slack * *std::max_element(next, next + count));
    next += chain.groups[k] > 1 ? 2 * count : rows;
  }
}

}  // namespace

BentPoints bent_points(const check::BentChain& chain, const SdpOptions& options) {
  BentPoints result;
  const bool has_groups = is_grouped(chain);
  const LiveChain live(chain.stages, has_groups);
  if (live.is_constant()) {
    result.stop = LipSdpStop::kGapReached;
    result.points = {{std::numeric_limits<double>::min(), live.multipliers(VectorXd())}};
    return result;
  }
  const ScaledBentChain scaled = scaled_to_one(chain, live);
  InteriorPointOptions solver;
  solver.stop = options.stop;
  solver.relative_gap = options.relative_gap;
  const std::optional<InteriorPointResult> found = minimise(scaled, solver);
  if (!found) return result;
  result.stop = found->stop;
  result.iterations = found->iterations;
  for (const VectorXd& point : found->points) {
    const VectorXd y = unscaled(scaled, point);
    const VectorXd t = y.tail(y.size() - 1);
    result.points.push_back(
        {y(0), has_groups ? std::vector<double>(t.begin(), t.end()) : live.multipliers(t)});
  }
  return result;
}

SdpBound bent_bound(const check::BentChain& chain, const SdpOptions& options) {
  const bool has_groups = is_grouped(chain);
  const std::vector<double> slacks = has_groups ? std::vector<double>{1e-7, 1e-6, 1e-5, 1e-4, 1e-3}
                                                : std::vector<double>{0.0, 1e-9, 1e-8, 1e-7};
  BentPoints found = bent_points(chain, options);
  SdpBound result;
  result.stop = found.stop;
  result.iterations = found.iterations;
  if (!found.points.empty()) result.optimum = Estimate(std::sqrt(found.points.back().rho));
  for (auto point = found.points.rbegin(); point != found.points.rend() && !result.proof; ++point) {
    if (options.known && !(point->rho < options.known->value() * options.known->value())) break;
    for (const double slack : slacks) {
      if (has_groups) set_multipliers_of_sums(chain, slack, point->t);
      result.proof = prove(chain, point->rho * (1 + slack), point->t);
      if (result.proof) break;
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz

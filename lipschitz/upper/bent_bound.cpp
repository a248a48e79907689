#include "lipschitz/upper/bent_bound.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "lipschitz/solver/chain_newton.h"
#include "lipschitz/solver/dense_kernels.h"
#include "lipschitz/upper/live_chain.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The chain scaled to stages of norm about one: M_k = stages[k] 2^exponents[k]. The slopes of neuron i of a hidden
/// layer lie in [low_i, low_i + width_i].
struct ScaledBentChain {
  ReluChain stages;
  std::vector<VectorXd> low, width;
  std::vector<int> exponents;
  Index inputs = 0, neurons = 0;
  Index size() const { return inputs + neurons; }
  std::size_t hidden_layers() const { return low.size(); }
  /// Returns the largest |slope| of each neuron of a layer.
  VectorXd steepest(std::size_t k) const {
    return low[k].cwiseAbs().cwiseMax((low[k] + width[k]).cwiseAbs());
  }
};

double norm_of(const MatrixXd& m) { return std::sqrt(largest_eigenvalue(m * m.transpose())); }

/// Sets the slope ranges of the live neurons.
void set_slopes(const check::BentChain& chain, const LiveChain& live, ScaledBentChain& result) {
  std::size_t before = 0;
  for (std::size_t k = 0; k < live.neurons().size(); ++k) {
    const std::vector<Index>& neurons = live.neurons()[k];
    VectorXd low(static_cast<Index>(neurons.size())), width = low;
    for (std::size_t i = 0; i < neurons.size(); ++i) {
      const check::SlopeRange& range = chain.slopes[before + static_cast<std::size_t>(neurons[i])];
      low(static_cast<Index>(i)) = to_double(range.low);
      width(static_cast<Index>(i)) = to_double(range.high - range.low);
    }
    before += static_cast<std::size_t>(chain.stages[k].rows);
    result.low.push_back(std::move(low));
    result.width.push_back(std::move(width));
  }
}

ScaledBentChain scaled_to_one(const check::BentChain& chain, const LiveChain& live) {
  ScaledBentChain result;
  result.stages = live.live();
  set_slopes(chain, live, result);
  MatrixXd& first = result.stages.front();
  if (first.cols() > first.rows()) {  // an orthogonal change of inputs drops the null space
    const Eigen::HouseholderQR<MatrixXd> qr(first.transpose());
    const MatrixXd r = qr.matrixQR().topRows(first.rows()).triangularView<Eigen::Upper>();
    first = r.transpose();
  }
  result.inputs = first.cols();
  for (std::size_t k = 0; k < result.stages.size(); ++k) {
    MatrixXd& m = result.stages[k];
    const bool is_hidden = k < result.hidden_layers();
    const double norm = norm_of(m) * (is_hidden ? result.steepest(k).maxCoeff() : 1.0);
    result.exponents.push_back(
        norm > 0 && std::isfinite(norm) ? static_cast<int>(std::lround(std::log2(norm))) : 0);
    m *= std::ldexp(1.0, -result.exponents.back());
    if (is_hidden) result.neurons += m.rows();
  }
  return result;
}

/// S(rho, t) in the variables (x, w_1, ..., w_{K-1}).
class BentInequality final : public RankTwoInequality {
 public:
  explicit BentInequality(const ScaledBentChain& chain)
      : inputs_(chain.inputs), a_(chain.size(), chain.neurons) {
    MatrixXd z = MatrixXd::Identity(inputs_, chain.size());  // layer output in terms of (x, w)
    Index begin = 0;
    for (std::size_t k = 0; k < chain.hidden_layers(); ++k) {
      const MatrixXd y = chain.stages[k] * z;
      const VectorXd root = chain.width[k].cwiseSqrt();
      z = chain.low[k].asDiagonal() * y;
      z.middleCols(inputs_ + begin, y.rows()).diagonal() += root;
      a_.middleCols(begin, y.rows()) = y.transpose() * root.asDiagonal();
      a_.block(inputs_ + begin, begin, y.rows(), y.rows()).diagonal().array() -= 1;
      begin += y.rows();
    }
    const MatrixXd f = chain.stages.back() * z;
    output_gram_ = f.transpose() * f;
  }

  Index size() const override { return a_.rows(); }
  Index inputs() const override { return inputs_; }

  MatrixXd linear(const VectorXd& y) const override {
    const MatrixXd weighted = a_ * y.tail(neurons()).asDiagonal();
    MatrixXd s = MatrixXd::Zero(size(), size());
    s.diagonal().head(inputs_).setConstant(y(0));
    s.rightCols(neurons()) -= weighted;
    s.bottomRows(neurons()) -= weighted.transpose();
    return s;
  }
  MatrixXd slack(const VectorXd& y) const override { return linear(y) - output_gram_; }
  MatrixXd times_a(const MatrixXd& x) const override { return x * a_; }
  MatrixXd a_transposed_times(const MatrixXd& x) const override { return a_.transpose() * x; }
  MatrixXd times_patterned(const MatrixXd& x, const MatrixXd& d) const override { return x * d; }

 private:
  Index inputs_;
  MatrixXd a_, output_gram_;
};

/// Returns multipliers that prove the product of norms with a margin. With weights l_k of |dz_k|^2, computed backwards
/// as l_{k-1} = 2 l_k max c^2 |M_k|^2, where c is the steepest slope of a neuron, the multiplier is t = l_k c / (b -
/// a), for which l_k z^2 + 2 t (z - a y) (b y - z) is at most l_k c^2 y^2. In the variables w the multiplier is t (b -
/// a).
VectorXd product_start(const ScaledBentChain& chain) {
  constexpr double kInside = 2;
  VectorXd y(1 + chain.neurons);
  const double last = norm_of(chain.stages.back());
  double weight = kInside * last * last;
  Index end = y.size();
  for (std::size_t k = chain.hidden_layers(); k-- > 0;) {
    const VectorXd steepest = chain.steepest(k);
    const double c = steepest.maxCoeff(), norm = norm_of(chain.stages[k]);
    end -= steepest.size();
    y.segment(end, steepest.size()) = weight * steepest;
    weight *= kInside * c * c * norm * norm;
  }
  y(0) = weight;
  return y;
}

/// Returns c of each layer if all neurons of a layer have the same range [1 - c, c], as is the case for all inputs.
std::optional<std::vector<double>> slopes_of_layers(const ScaledBentChain& chain) {
  std::vector<double> result;
  for (std::size_t k = 0; k < chain.hidden_layers(); ++k) {
    const double low = chain.low[k](0), width = chain.width[k](0);
    const bool is_one = (chain.low[k].array() == low).all() && (chain.width[k].array() == width).all();
    if (!is_one || low > 0 || width != 1 - 2 * low) return std::nullopt;
    result.push_back(1 - low);
  }
  return result;
}

/// Solves by blocks if that is faster, else as a dense program; returns nothing if that is too large.
std::optional<InteriorPointResult> minimise(const ScaledBentChain& chain,
                                            const InteriorPointOptions& options) {
  if (const std::optional<std::vector<double>> slopes = slopes_of_layers(chain)) {
    std::optional<InteriorPointResult> found =
        minimise_long_chain(ChainSlack(chain.stages, *slopes), options);
    if (found) {
      for (VectorXd& y : found->points) {  // converts to multipliers in w
        Index next = 1;
        for (const VectorXd& width : chain.width) {
          y.segment(next, width.size()).array() *= width.array();
          next += width.size();
        }
      }
      return found;
    }
  } else if (chain.size() > kMostBentVariables) {
    return std::nullopt;
  }
  return minimise(BentInequality(chain), product_start(chain), options);
}

/// Converts (rho, t) to the units of the original chain.
VectorXd unscaled(const ScaledBentChain& chain, VectorXd y) {
  int total = 0, up_to = 0;
  for (const int e : chain.exponents) total += e;
  y(0) = std::ldexp(y(0), 2 * total);
  Index next = 1;
  for (std::size_t k = 0; k < chain.hidden_layers(); ++k) {
    up_to += chain.exponents[k];
    for (Index i = 0; i < chain.stages[k].rows(); ++i, ++next)
      y(next) = std::ldexp(y(next), 2 * (total - up_to)) / chain.width[k](i);
  }
  return y;
}

}  // namespace

BentPoints bent_points(const check::BentChain& chain, const SdpOptions& options) {
  BentPoints result;
  const LiveChain live(chain.stages);
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
    result.points.push_back({y(0), live.multipliers(y.tail(y.size() - 1))});
  }
  return result;
}

SdpBound bent_bound(const check::BentChain& chain, const SdpOptions& options) {
  const BentPoints found = bent_points(chain, options);
  SdpBound result;
  result.stop = found.stop;
  result.iterations = found.iterations;
  if (!found.points.empty()) result.optimum = Estimate(std::sqrt(found.points.back().rho));
  for (auto point = found.points.rbegin(); point != found.points.rend() && !result.proof; ++point) {
    if (options.known && !(point->rho < options.known->value() * options.known->value())) break;
    for (const double slack : {0.0, 1e-9, 1e-8, 1e-7}) {
      result.proof = prove(chain, point->rho * (1 + slack), point->t);
      if (result.proof) break;
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz

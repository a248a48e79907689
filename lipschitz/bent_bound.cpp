#include "lipschitz/bent_bound.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "lipschitz/chain_newton.h"
#include "lipschitz/dense_kernels.h"
#include "lipschitz/live_chain.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// c of each hidden layer, from g = c (c - 1).
std::vector<double> largest_slopes(const check::BentChain& chain) {
  std::vector<double> result;
  for (const check::Dyadic& g : chain.bends) result.push_back((1 + std::sqrt(1 + 4 * to_double(g))) / 2);
  return result;
}

/// The chain with stages of norm about one, and what its own are: M_k = stages[k] 2^exponents[k].
struct ScaledBentChain {
  ReluChain stages;
  std::vector<double> c;
  std::vector<int> exponents;
  Index inputs = 0, neurons = 0;
  Index size() const { return inputs + neurons; }
};

double norm_of(const MatrixXd& m) { return std::sqrt(largest_eigenvalue(m * m.transpose())); }

ScaledBentChain scaled_to_one(ReluChain chain, std::vector<double> c) {
  ScaledBentChain result{std::move(chain), std::move(c), {}, 0, 0};
  MatrixXd& first = result.stages.front();
  if (first.cols() > first.rows()) {  // an orthogonal change of inputs drops the null space
    const Eigen::HouseholderQR<MatrixXd> qr(first.transpose());
    const MatrixXd r = qr.matrixQR().topRows(first.rows()).triangularView<Eigen::Upper>();
    first = r.transpose();
  }
  result.inputs = first.cols();
  for (std::size_t k = 0; k < result.stages.size(); ++k) {
    MatrixXd& m = result.stages[k];
    const double norm = norm_of(m) * (k < result.c.size() ? result.c[k] : 1.0);
    result.exponents.push_back(
        norm > 0 && std::isfinite(norm) ? static_cast<int>(std::lround(std::log2(norm))) : 0);
    m *= std::ldexp(1.0, -result.exponents.back());
    if (k < result.c.size()) result.neurons += m.rows();
  }
  return result;
}

/// S(rho, t) in the variables (x, u_1, ..., u_{K-1}).
class BentInequality final : public RankTwoInequality {
 public:
  explicit BentInequality(const ScaledBentChain& chain)
      : inputs_(chain.inputs), a_(chain.size(), chain.neurons) {
    MatrixXd z = MatrixXd::Identity(inputs_, chain.size());  // what leaves the layer at hand, of (x, u)
    Index begin = 0;
    for (std::size_t k = 0; k < chain.c.size(); ++k) {
      const MatrixXd y = chain.stages[k] * z;
      const double c = chain.c[k];
      z = (1 - c) * y;
      z.middleCols(inputs_ + begin, y.rows()).diagonal().array() += 1;
      a_.middleCols(begin, y.rows()) = (2 * c - 1) * y.transpose();
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

/// The multipliers that prove the product of norms, well inside: with |dz_k|^2 weighted by l_k, backwards
/// l_{k-1} = 2 l_k c^2 |M_k|^2, and t_k = l_k c / (2 c - 1), for which l_k |z|^2 + 2 t_k (z (y - z) + g y^2) is at
/// most l_k c^2 |y|^2.
VectorXd product_start(const ScaledBentChain& chain) {
  constexpr double kInside = 2;
  VectorXd y(1 + chain.neurons);
  const double last = norm_of(chain.stages.back());
  double weight = kInside * last * last;
  Index end = y.size();
  for (std::size_t k = chain.c.size(); k-- > 0;) {
    const double c = chain.c[k], norm = norm_of(chain.stages[k]);
    const Index rows = chain.stages[k].rows();
    end -= rows;
    y.segment(end, rows).setConstant(weight * c / (2 * c - 1));
    weight *= kInside * c * c * norm * norm;
  }
  y(0) = weight;
  return y;
}

/// (rho, t) in the units of the chain itself.
VectorXd unscaled(const ScaledBentChain& chain, VectorXd y) {
  int total = 0, up_to = 0;
  for (const int e : chain.exponents) total += e;
  y(0) = std::ldexp(y(0), 2 * total);
  Index next = 1;
  for (std::size_t k = 0; k < chain.c.size(); ++k) {
    up_to += chain.exponents[k];
    for (Index i = 0; i < chain.stages[k].rows(); ++i, ++next)
      y(next) = std::ldexp(y(next), 2 * (total - up_to));
  }
  return y;
}

}  // namespace

SdpBound bent_bound(const check::BentChain& chain, const SdpOptions& options) {
  SdpBound result;
  const LiveChain live(chain.stages);
  if (live.is_constant()) {
    result.stop = LipSdpStop::kGapReached;
    result.proof = prove(chain, std::numeric_limits<double>::min(), live.multipliers(VectorXd()));
    return result;
  }
  const ScaledBentChain scaled = scaled_to_one(live.live(), largest_slopes(chain));
  InteriorPointOptions solver;
  solver.stop = options.stop;
  std::optional<InteriorPointResult> found = minimise_long_chain(ChainSlack(scaled.stages, scaled.c), solver);
  if (!found) found = minimise(BentInequality(scaled), product_start(scaled), solver);
  result.stop = found->stop;
  result.iterations = found->iterations;
  for (auto point = found->points.rbegin(); point != found->points.rend() && !result.proof; ++point) {
    const VectorXd y = unscaled(scaled, *point);
    if (point == found->points.rbegin()) result.optimum = Estimate(std::sqrt(y(0)));
    if (options.known && !(y(0) < options.known->value() * options.known->value())) break;
    const std::vector<double> t = live.multipliers(y.tail(y.size() - 1));
    for (const double slack : {0.0, 1e-9, 1e-8, 1e-7}) {
      result.proof = prove(chain, y(0) * (1 + slack), t);
      if (result.proof) break;
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz

#include "lipschitz/values/sum_climb.h"

#include <algorithm>
#include <cmath>

#include "nn/base/random.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr int kRandomPoints = 2000, kSteps = 3000;
/// The last steps are this much shorter than a side of the box.
constexpr double kShortest_log2 = -14;
/// Share of the coordinates that a step moves.
constexpr double kMoved = 0.5;

double value_at(const std::vector<PlacedTerm>& terms, const ReachNetwork& rho, const RowVectorXd& direction,
                const std::vector<VectorXd>& x) {
  VectorXd sum;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const VectorXd term = terms[k].count * evaluate_roughly(*terms[k].network, x[k]);
    sum = k == 0 ? term : VectorXd(sum + term);
  }
  return direction.dot(evaluate_roughly(rho, sum));
}

/// `x` with coordinates moved by up to `scale` sides of the box; without an `x` anywhere, often at an end.
VectorXd moved(const Box& box, const VectorXd* x, double scale, files::Random& random) {
  VectorXd result(static_cast<Index>(box.lower.size()));
  for (Index j = 0; j < result.size(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double side = box.upper[i] - box.lower[i];
    double to = box.lower[i] + (2 * random.uniform() - 0.5) * side;
    if (x != nullptr) to = (*x)(j) + (random.uniform() < kMoved ? scale * side * random.symmetric() : 0);
    result(j) = std::clamp(to, box.lower[i], box.upper[i]);
  }
  return result;
}

}  // namespace

std::vector<VectorXd> climb(const std::vector<PlacedTerm>& terms, const ReachNetwork& rho,
                            const RowVectorXd& direction, const std::vector<std::vector<VectorXd>>& starts) {
  files::Random random(1);
  std::vector<VectorXd> best;
  double largest = 0;
  const auto take = [&](std::vector<VectorXd> x) {
    const double value = value_at(terms, rho, direction, x);
    if (!best.empty() && !(value > largest)) return;
    largest = value;
    best = std::move(x);
  };
  for (const std::vector<VectorXd>& start : starts) take(start);
  for (int i = 0; i < kRandomPoints + kSteps; ++i) {
    const bool is_step = i >= kRandomPoints;
    const double scale = std::exp2(kShortest_log2 * (i - kRandomPoints) / kSteps);
    std::vector<VectorXd> x;
    for (std::size_t k = 0; k < terms.size(); ++k)
      x.push_back(moved(*terms[k].box, is_step ? &best[k] : nullptr, scale, random));
    take(std::move(x));
  }
  return best;
}

}  // namespace swarmcert::lipschitz

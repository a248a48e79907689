#include "analysis/tracking/conformal.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace swarmcert::analysis {
namespace {

/// Tolerance for rounding in sums of weights such as 1/3 + 1/3 + 1/3.
constexpr double kWeightRounding = 1e-9;

/// P(at least `least` hits in `runs`), each with probability p in (0, 1).
double binomial_tail(int runs, int least, double p) {
  double total = 0;
  for (int k = least; k <= runs; ++k) {
    total += std::exp(std::lgamma(runs + 1.0) - std::lgamma(k + 1.0) - std::lgamma(runs - k + 1.0) +
                      k * std::log(p) + (runs - k) * std::log1p(-p));
  }
  return total;
}

}  // namespace

int fewest_groups(double level) { return static_cast<int>(std::ceil(level / (1 - level) - kWeightRounding)); }

double beta_quantile(int a, int b, double probability) {
  // P(Beta(a, b) <= x) = P(at least a hits in a + b - 1).
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (binomial_tail(a + b - 1, a, middle) < probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

ConformalThreshold conformal_threshold(const std::vector<FlightScore>& scores, double level) {
  if (!(level > 0 && level < 1)) throw std::invalid_argument("conformal_threshold: level not in (0, 1)");
  const std::vector<double> weights = group_weights(scores);
  ConformalThreshold result;
  result.level = level;
  result.groups = static_cast<int>(std::lround(std::accumulate(weights.begin(), weights.end(), 0.0)));
  result.flights = static_cast<int>(scores.size());
  if (result.groups < fewest_groups(level)) {
    throw std::invalid_argument("conformal_threshold: too few groups for this level");
  }
  std::vector<std::pair<double, double>> weighted;
  for (std::size_t i = 0; i < scores.size(); ++i) weighted.emplace_back(scores[i].value, weights[i]);
  std::sort(weighted.begin(), weighted.end());
  const double needed = level * (result.groups + 1) - kWeightRounding;
  double weight = 0;
  for (const auto& [value, of_flight] : weighted) {
    weight += of_flight;
    result.threshold = value;
    if (weight >= needed) break;
  }
  const int rank = std::min(result.groups, static_cast<int>(std::ceil(needed)));
  result.coverage_90 = {beta_quantile(rank, result.groups + 1 - rank, 0.05),
                        beta_quantile(rank, result.groups + 1 - rank, 0.95)};
  return result;
}

}  // namespace swarmcert::analysis

#include "stability/bounds/amplitude_and_rate.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

namespace swarmcert::stability {
namespace {

/// Computes argmin over u of sum_i weight_i |u_i - h_i| + sum_i |u_(i+1) - u_i|, u = 0 before and after, exactly. The
/// derivative of the optimal cost up to i is a nondecreasing staircase, stored as its jumps; each total-variation term
/// clips it to [-1, 1] (Johnson, J. Comput. Graph. Stat. 22, 2013).
class TotalVariation {
 public:
  TotalVariation(const std::vector<double>& h, const std::vector<double>& weight) : h_(h), weight_(weight) {}

  std::vector<double> solve() {
    // Cost of the first value: |u - 0|, derivative -1 below 0 and +1 above.
    steps_ = {{0.0, 2.0}};
    lowest_ = -1;
    std::vector<double> low(h_.size());
    std::vector<double> high(h_.size());
    for (std::size_t i = 0; i < h_.size(); ++i) {
      steps_.insert({h_[i], 2 * weight_[i]});
      lowest_ -= weight_[i];
      minus_highest_ -= weight_[i];
      low[i] = clip(lowest_, true);
      high[i] = clip(minus_highest_, false);
    }
    std::vector<double> u(h_.size());
    double next = 0;  // after the last value
    for (std::size_t i = h_.size(); i-- > 0;) {
      next = std::min(std::max(next, low[i]), high[i]);
      u[i] = next;
    }
    return u;
  }

 private:
  /// Clips one end of the derivative to at least -1 by removing steps there; returns the position where it crosses -1.
  double clip(double& end, bool is_low) {
    const auto outermost = [&] { return is_low ? steps_.begin() : std::prev(steps_.end()); };
    double at = steps_.empty() ? 0 : outermost()->first;
    while (end < -1 && !steps_.empty()) {
      const auto step = outermost();
      at = step->first;
      end += step->second;
      steps_.erase(step);
      if (end <= -1) continue;
      steps_.insert({at, end + 1});
      end = -1;
      return at;
    }
    end = std::max(end, -1.0);
    return at;
  }

  const std::vector<double>& h_;
  const std::vector<double>& weight_;
  std::multimap<double, double> steps_;  ///< jumps of the derivative by position
  double lowest_ = -1;
  double minus_highest_ = -1;
};

/// Nodes at which u may bend: all of the first ones, then a subset such that about twenty thousand remain.
std::vector<std::size_t> bends(std::size_t count) {
  constexpr std::size_t kDense = 12'000;
  constexpr std::size_t kSparse = 8'000;
  std::vector<std::size_t> nodes;
  const std::size_t stride = count > kDense + kSparse ? (count - kDense) / kSparse + 1 : 1;
  for (std::size_t i = 0; i < count; i += i < kDense ? 1 : stride) nodes.push_back(i);
  if (nodes.back() != count - 1) nodes.push_back(count - 1);
  return nodes;
}

}  // namespace

double split_bound(const StepResponse& h, double amplitude, double rate) {
  const std::size_t count = h.value.size();
  const std::vector<std::size_t> nodes = bends(count);
  std::vector<double> time(count, 0.0);
  for (std::size_t i = 1; i < count; ++i) time[i] = time[i - 1] + h.length[i - 1];
  std::vector<double> values;
  std::vector<double> weights;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const double from = time[nodes[k > 0 ? k - 1 : k]];
    const double to = time[nodes[k + 1 < nodes.size() ? k + 1 : k]];
    values.push_back(h.value[nodes[k]]);
    weights.push_back(rate / amplitude * (to - from) / 2);
  }
  const std::vector<double> u = TotalVariation(values, weights).solve();

  double variation = std::abs(u.front());
  double rest = 0;
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    variation += std::abs(u[k + 1] - u[k]);
    const double span = time[nodes[k + 1]] - time[nodes[k]];
    double before = std::abs(h.value[nodes[k]] - u[k]);
    for (std::size_t i = nodes[k] + 1; i <= nodes[k + 1]; ++i) {
      const double share = span > 0 ? (time[i] - time[nodes[k]]) / span : 1;
      const double here = std::abs(h.value[i] - (u[k] + share * (u[k + 1] - u[k])));
      // |h - u| is at most the chord of its end values, as it is convex, plus the deviation of h from its own chord.
      rest += (before + here) / 2 * h.length[i - 1] + h.bend[i - 1];
      before = here;
    }
  }
  // After the last node u is either zero, or equal to h, which then only decreases.
  double end = amplitude * std::abs(u.back()) + rate * h.after;
  if (h.falls_after) {
    end = std::min(end, amplitude * (std::abs(u.back() - h.value.back()) + std::abs(h.value.back())));
  }
  return amplitude * variation + rate * rest + end;
}

}  // namespace swarmcert::stability

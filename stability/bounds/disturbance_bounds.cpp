#include "stability/bounds/disturbance_bounds.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

namespace swarmcert::stability {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// factor * what is known, where "nothing known" stays infinite even for a factor of 0.
double times(double factor, double known) { return std::isinf(known) ? kInfinity : factor * known; }

/// The response after `after_s` has passed, as a response of its own: same poles, new initial values.
TransferFunction later(const TransferFunction& y, double after_s) {
  // y, y', ..., y^(n-1) at after_s: from the responses of s^k Y without their jumps, whose samples obey the same
  // equation; one sample each.
  const Polynomial total = sum(y.denominator, y.feedback);
  const std::size_t n = total.size() - 1;
  Polynomial numerator = y.numerator;
  numerator.resize(n, 0.0);
  std::vector<double> state;
  for (std::size_t k = 0; k < n; ++k) {
    state.push_back(sampled_response({numerator, total, {}, 0}, after_s, 2)[1]);
    // s Y - y(0+): shift, then take the leading term out.
    const double y0 = numerator[n - 1] / total[n];
    Polynomial shifted(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) shifted[i] = (i > 0 ? numerator[i - 1] : 0) - y0 * total[i];
    numerator = shifted;
  }
  Polynomial result(n, 0.0);
  for (std::size_t k = 1; k <= n; ++k) {
    for (std::size_t j = 0; j < k; ++j) result[k - 1 - j] += total[k] * state[j];
  }
  return {result, total, {}, 0};
}

/// argmin over u of sum_i weight |u_i - h_i| + sum_i |u_(i+1) - u_i|, u = 0 before and after: exact. The derivative of
/// the optimal cost up to i is a nondecreasing staircase, kept as its jumps; a term of the total variation clips it to
/// [-1, 1] (Johnson, J. Comput. Graph. Stat. 22, 2013).
class TotalVariation {
 public:
  TotalVariation(const std::vector<double>& h, double weight) : h_(h), weight_(weight) {}

  std::vector<double> solve() {
    // Cost of the first value: |u - 0|, derivative -1 below 0 and +1 above.
    steps_ = {{0.0, 2.0}};
    lowest_ = -1;
    std::vector<double> low(h_.size());
    std::vector<double> high(h_.size());
    for (std::size_t i = 0; i < h_.size(); ++i) {
      steps_.insert({h_[i], 2 * weight_});
      lowest_ -= weight_;
      highest_ += weight_;
      low[i] = clip_low();
      high[i] = clip_high();
    }
    std::vector<double> u(h_.size());
    double next = 0;  // after the last
    for (std::size_t i = h_.size(); i-- > 0;) {
      next = std::min(std::max(next, low[i]), high[i]);
      u[i] = next;
    }
    return u;
  }

 private:
  /// Raises the derivative to at least -1: removes steps from below; the place where it passes -1.
  double clip_low() {
    double at = steps_.empty() ? 0 : steps_.begin()->first;
    while (lowest_ < -1 && !steps_.empty()) {
      const auto first = steps_.begin();
      at = first->first;
      const double jump = first->second;
      steps_.erase(first);
      if (lowest_ + jump > -1) {
        steps_.insert({at, lowest_ + jump + 1});
        lowest_ = -1;
        return at;
      }
      lowest_ += jump;
    }
    lowest_ = std::max(lowest_, -1.0);
    return at;
  }
  double clip_high() {
    double at = steps_.empty() ? 0 : std::prev(steps_.end())->first;
    while (highest_ > 1 && !steps_.empty()) {
      const auto last = std::prev(steps_.end());
      at = last->first;
      const double jump = last->second;
      steps_.erase(last);
      if (highest_ - jump < 1) {
        steps_.insert({at, 1 - (highest_ - jump)});
        highest_ = 1;
        return at;
      }
      highest_ -= jump;
    }
    highest_ = std::min(highest_, 1.0);
    return at;
  }

  const std::vector<double>& h_;
  const double weight_;
  std::multimap<double, double> steps_;  ///< where the derivative jumps, and by how much
  double lowest_ = -1;
  double highest_ = 1;
};

}  // namespace

double DisturbanceBounds::least() const {
  return std::min({by_rate, by_amplitude, by_edges, by_impulse, by_both});
}

std::string DisturbanceBounds::which() const {
  const double best = least();
  if (std::isinf(best)) return "none";
  if (by_impulse == best) return "impulse";
  if (by_edges == best) return "edges";
  if (by_rate == best) return "rate";
  if (by_amplitude == best) return "amplitude";
  return "amplitude and rate";
}

double impulse_gain_after(const AxisLoop& loop, Channel channel, double after_s) {
  const TransferFunction y = impulse_transfer(loop, channel);
  if (!is_stable(y)) return kInfinity;
  if (after_s <= 0) return response_norms(y).max_abs();
  if (y.delay_s == 0) return response_norms(later(y, after_s)).max_abs();
  // With a delay: samples, and what can happen between two of them.
  const ResponseNorms norms = response_norms(y);
  constexpr int kCount = 200'001;
  const double step_s = std::max(4 * after_s, 400 * y.delay_s) / kCount;
  const std::vector<double> samples = sampled_response(y, step_s, kCount);
  double result = 0;
  for (auto i = static_cast<std::size_t>(after_s / step_s); i < samples.size(); ++i) {
    result = std::max(result, std::abs(samples[i]));
  }
  return std::min(norms.max_abs(), result + norms.slope_max_abs * step_s / 2);
}

double amplitude_and_rate_bound(const AxisLoop& loop, Channel channel, double amplitude_N, double rate_N_s,
                                int nodes) {
  const GainNorms gains = continuous_norms(loop, channel);
  const double simple = std::min(times(gains.rate, rate_N_s), times(gains.amplitude, amplitude_N));
  if (!std::isfinite(gains.rate) || !std::isfinite(amplitude_N) || !std::isfinite(rate_N_s)) return simple;
  if (amplitude_N == 0 || rate_N_s == 0) return 0;
  const TransferFunction h = step_transfer(loop, channel);
  double slowest = kInfinity;
  for (const std::complex<double>& pole : poles(sum(h.denominator, h.feedback))) {
    slowest = std::min(slowest, -pole.real());
  }
  const double horizon_s = 25 / slowest;  // e^-25 of the rate bound is left out of the split, and added below
  const double step_s = horizon_s / (nodes - 1);
  const std::vector<double> samples = sampled_response(h, step_s, nodes);
  const std::vector<double> u = TotalVariation(samples, rate_N_s * step_s / amplitude_N).solve();
  double variation = std::abs(u.front()) + std::abs(u.back());
  double rest = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    if (i > 0) variation += std::abs(u[i] - u[i - 1]);
    rest += std::abs(samples[i] - u[i]) * (i == 0 || i + 1 == u.size() ? step_s / 2 : step_s);
  }
  // Between nodes u is linear and h bends: |h - u| exceeds the chord by at most step^2/8 sup |h''| there, over all
  // cells step^2/12 |h''|_1 to leading order, doubled for the variation of h'' inside a cell. After the horizon u = 0.
  const ResponseNorms norms = response_norms(h);
  const double between = step_s * step_s / 6 * norms.curvature_integral;
  const double after = 1e-9 * gains.rate;
  return std::min(simple, amplitude_N * variation + rate_N_s * (rest + between + after));
}

DisturbanceBounds disturbance_bounds(const GainNorms& gains, const Disturbance& disturbance) {
  DisturbanceBounds bounds;
  bounds.by_rate = times(gains.rate, disturbance.rate_N_s);
  bounds.by_amplitude = times(gains.amplitude, disturbance.amplitude_N);
  bounds.by_edges = times(gains.edge, disturbance.variation_N);
  bounds.by_impulse = times(gains.impulse * disturbance.passes, disturbance.impulse_N_s);
  bounds.by_both = std::min(bounds.by_rate, bounds.by_amplitude);
  return bounds;
}

DisturbanceBounds disturbance_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance) {
  const GainNorms gains = continuous_norms(loop, channel);
  DisturbanceBounds bounds = disturbance_bounds(gains, disturbance);
  if (std::isfinite(bounds.by_impulse) && disturbance.passes > 1) {
    double felt = gains.impulse;
    for (int k = 1; k < disturbance.passes; ++k) {
      const double after_s = std::max(0.0, k * disturbance.pass_period_s - disturbance.pass_length_s);
      felt += impulse_gain_after(loop, channel, after_s);
    }
    bounds.by_impulse = felt * disturbance.impulse_N_s;
  }
  if (std::isfinite(bounds.by_rate) && std::isfinite(bounds.by_amplitude)) {
    bounds.by_both = amplitude_and_rate_bound(loop, channel, disturbance.amplitude_N, disturbance.rate_N_s);
  }
  return bounds;
}

ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance, double bias_N,
                         double integral_share, double limit_m_s) {
  ClampBounds result;
  if (loop.Ki == 0) return result;
  result.exists = std::isfinite(limit_m_s);
  const GainNorms gains = continuous_norms(loop, channel);
  const double bias_m_s = std::abs(bias_N) / (loop.mass_kg * loop.Ki);
  result.demand_m_s =
      integral_share * (std::min(times(gains.rate, disturbance.amplitude_N),
                                 times(gains.edge * disturbance.passes, disturbance.impulse_N_s)) +
                        bias_m_s);
  result.never_acts = std::isinf(limit_m_s) || result.demand_m_s <= limit_m_s;
  if (std::isinf(limit_m_s)) return result;
  AxisLoop without = loop;
  without.Ki = 0;
  const GainNorms pd = continuous_norms(without, channel);
  // The integrator's force: m Ki_written I, and Ki_written = Ki / share.
  const double integral_N = loop.mass_kg * loop.Ki / integral_share * limit_m_s;
  result.by_amplitude =
      times(pd.amplitude, disturbance.amplitude_N) + pd.amplitude * (integral_N + std::abs(bias_N));
  result.by_impulse = times(pd.impulse * disturbance.passes, disturbance.impulse_N_s) +
                      pd.amplitude * (integral_N + std::abs(bias_N));
  return result;
}

std::vector<double> worst_amplitude_input(const AxisLoop& loop, Channel channel, double step_s, int count) {
  std::vector<double> input = sampled_response(impulse_transfer(loop, channel), step_s, count);
  std::reverse(input.begin(), input.end());
  for (double& f : input) f = f > 0 ? 1 : f < 0 ? -1 : 0;
  return input;
}

double staircase_error(const GainNorms& gains, double rate_hz, double latency_s, double rate_of_f_hat_N_s) {
  const double age_s = (rate_hz > 0 ? 1 / rate_hz : 0) + latency_s;
  return age_s == 0 ? 0 : gains.amplitude * age_s * rate_of_f_hat_N_s;
}

}  // namespace swarmcert::stability

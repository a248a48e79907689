#include "stability/bounds/disturbance_bounds.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "nn/base/doubles.h"
#include "stability/bounds/amplitude_and_rate.h"

namespace swarmcert::stability {
namespace {

/// Returns the response from `after_s` on as a separate response: same poles, new initial values.
TransferFunction later(const TransferFunction& y, double after_s) {
  // y, y', ..., y^(n-1) at after_s are obtained from the responses of s^k Y without their jumps, which obey the same
  // equation; one sample each.
  const Polynomial total = sum(y.denominator, y.feedback);
  const std::size_t n = total.size() - 1;
  Polynomial numerator = y.numerator;
  numerator.resize(n, 0.0);
  std::vector<double> state;
  for (std::size_t k = 0; k < n; ++k) {
    state.push_back(sampled_response({numerator, total, {}, 0}, after_s, 2)[1]);
    // s Y - y(0+): shift the coefficients, then subtract the leading term.
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

/// sup |y(t)| over t >= after_s of a stable response.
class FadingResponse {
 public:
  explicit FadingResponse(const TransferFunction& y) : y_(y) {
    const ResponseNorms norms = response_norms(y);
    peak_ = norms.max_abs();
    if (y.delay_s == 0) return;
    // With a delay: samples, plus the largest change between two of them.
    constexpr int kCount = 200'001;
    double slowest = kInfinity;
    for (const std::complex<double>& pole : poles(sum(y.denominator, y.feedback))) {
      slowest = std::min(slowest, std::abs(pole));
    }
    step_s_ = std::max(60 / slowest, 400 * y.delay_s) / kCount;
    between_ = norms.slope_max_abs * step_s_ / 2;
    later_ = sampled_response(y, step_s_, kCount);
    for (double& sample : later_) sample = std::abs(sample);
    for (std::size_t i = later_.size() - 1; i-- > 0;) later_[i] = std::max(later_[i], later_[i + 1]);
  }

  double operator()(double after_s) const {
    if (after_s <= 0) return peak_;
    if (y_.delay_s == 0) return response_norms(later(y_, after_s)).max_abs();
    // Beyond the last sample the response is below the bound at that sample, which includes at least the slack
    // between_.
    const auto i = std::min(static_cast<std::size_t>(after_s / step_s_), later_.size() - 1);
    return std::min(peak_, later_[i] + between_);
  }

 private:
  TransferFunction y_;
  double peak_ = 0;
  double step_s_ = 0, between_ = 0;
  std::vector<double> later_;  ///< largest of this sample and all later ones
};

}  // namespace

void DisturbanceBounds::add(double error_m) {
  for (double* const bound : {&by_rate, &by_amplitude, &by_edges, &by_impulse, &by_both}) *bound += error_m;
}

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

double amplitude_and_rate_bound(const AxisLoop& loop, Channel channel, double amplitude_N, double rate_N_s,
                                int nodes) {
  const GainNorms gains = continuous_norms(loop, channel);
  const double simple =
      std::min(times_known(gains.rate, rate_N_s), times_known(gains.amplitude, amplitude_N));
  if (!std::isfinite(gains.rate) || !std::isfinite(amplitude_N) || !std::isfinite(rate_N_s)) return simple;
  if (amplitude_N == 0 || rate_N_s == 0) return 0;
  const TransferFunction h = step_transfer(loop, channel);
  double slowest = kInfinity;
  for (const std::complex<double>& pole : poles(sum(h.denominator, h.feedback))) {
    slowest = std::min(slowest, -pole.real());
  }
  const double horizon_s = 25 / slowest;  // the split omits e^-25 of the rate bound, which is added below
  const double step_s = horizon_s / (nodes - 1);
  const auto cells = static_cast<std::size_t>(nodes) - 1;
  // The deviation of h from its chord is at most step^2/8 sup |h''| on a cell, or step^2/12 |h''|_1 over all cells to
  // leading order; doubled to allow for the variation of h'' within a cell. It is distributed evenly, as only the sum
  // matters. Beyond the horizon u = 0.
  const double between = step_s * step_s / 6 * response_norms(h).curvature_integral;
  const StepResponse step = {sampled_response(h, step_s, nodes), std::vector<double>(cells, step_s),
                             std::vector<double>(cells, between / static_cast<double>(cells)),
                             1e-9 * gains.rate};
  return std::min(simple, split_bound(step, amplitude_N, rate_N_s));
}

double felt_passes(const Disturbance& disturbance, const std::function<double(double)>& gain_after) {
  double total = gain_after(0);
  for (int k = 1; k < disturbance.passes; ++k) {
    const double after_s = std::max(0.0, k * disturbance.pass_period_s - disturbance.pass_length_s);
    const double gain = gain_after(after_s);
    const int left = disturbance.passes - k;
    if (gain * left < 1e-9 * total) return total + gain * left;  // gains decrease: no later one is larger
    total += gain;
  }
  return total;
}

DisturbanceBounds bounds_by_class(const GainNorms& gains, const Disturbance& disturbance, bool has_integrator,
                                  const FeltPasses& felt) {
  DisturbanceBounds bounds;
  bounds.by_rate = times_known(gains.rate, disturbance.rate_N_s);
  bounds.by_amplitude = times_known(gains.amplitude, disturbance.amplitude_N);
  bounds.by_edges = times_known(gains.edge, disturbance.variation_N);
  bounds.by_impulse = times_known(gains.impulse, disturbance.impulse_N_s);
  bounds.by_both = std::min(bounds.by_rate, bounds.by_amplitude);
  if (!felt.impulses) return bounds;
  if (std::isfinite(bounds.by_impulse) && disturbance.passes > 1)
    bounds.by_impulse = disturbance.impulse_N_s * felt.impulses();
  if (disturbance.variation_per_pass) {
    // The force also rises once from zero; without an integrator the effect of every edge is permanent.
    bounds.by_edges = kInfinity;
    if (std::isfinite(disturbance.variation_N) && has_integrator)
      bounds.by_edges =
          times_known(gains.edge, disturbance.amplitude_N) + disturbance.variation_N * felt.edges();
  }
  return bounds;
}

DisturbanceBounds disturbance_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance) {
  const GainNorms gains = continuous_norms(loop, channel);
  FeltPasses felt;
  if (is_stable(loop)) {
    felt.impulses = [&] { return felt_passes(disturbance, FadingResponse(impulse_transfer(loop, channel))); };
    felt.edges = [&] { return felt_passes(disturbance, FadingResponse(step_transfer(loop, channel))); };
  }
  DisturbanceBounds bounds = bounds_by_class(gains, disturbance, loop.Ki > 0, felt);
  if (is_stable(loop) && std::isfinite(bounds.by_rate) && std::isfinite(bounds.by_amplitude)) {
    bounds.by_both = amplitude_and_rate_bound(loop, channel, disturbance.amplitude_N, disturbance.rate_N_s);
  }
  return bounds;
}

double effort_of_class_N(const AxisLoop& loop, Channel channel, const Disturbance& disturbance) {
  const double own = channel == Channel::kCommand ? 1 : 0;
  const double by_amplitude = times_known(effort_gain(loop, channel) - own, disturbance.largest_N());
  const double by_impulse =
      times_known(effort_impulse_gain(loop, channel) * disturbance.passes, disturbance.impulse_N_s);
  return times_known(own, disturbance.largest_N()) + std::min(by_amplitude, by_impulse);
}

ClampBounds clamp_demand(const AxisLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s) {
  ClampBounds result;
  if (loop.Ki == 0 || std::isinf(limit_m_s)) return result;
  result.exists = true;
  const GainNorms gains = continuous_norms(loop, channel);
  double demand_m_s = times_known(gains.rate, disturbance.amplitude_N);
  if (std::isfinite(disturbance.impulse_N_s) && is_stable(loop)) {
    const double felt = disturbance.passes == 1
                            ? gains.edge
                            : felt_passes(disturbance, FadingResponse(step_transfer(loop, channel)));
    demand_m_s = std::min(demand_m_s, disturbance.impulse_N_s * felt);
  }
  result.set_demand(demand_m_s + integral_demand_m_s(loop, channel, other), limit_m_s);
  return result;
}

ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s) {
  return clamp_bounds_of(
      loop, channel, disturbance, other, limit_m_s, [&](const AxisLoop& without, const GainNorms& pd) {
        return disturbance.passes == 1
                   ? pd.impulse
                   : felt_passes(disturbance, FadingResponse(impulse_transfer(without, channel)));
      });
}

double staircase_error(const GainNorms& gains, double rate_hz, double latency_s, double rate_of_f_hat_N_s) {
  const double age_s = (rate_hz > 0 ? 1 / rate_hz : 0) + latency_s;
  return age_s == 0 ? 0 : gains.amplitude * age_s * rate_of_f_hat_N_s;
}

}  // namespace swarmcert::stability

#include "stability/bounds/thrust_ratio.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/loops/kernel_sum.h"
#include "stability/bounds/loops/sampled_adjoint.h"
#include "stability/bounds/uncertain/uncertain_norms.h"

namespace swarmcert::stability {
namespace {

GainNorms largest(const UncertainNorms& norms) {
  return {norms.rate.upper, norms.amplitude.upper, norms.edge.upper, norms.impulse.upper};
}

/// The interval of the ratio, with mass, lags and delay as given.
UncertainPlant ratio_only(const AxisLoop& loop, double ratio_error) {
  return {{loop.mass_kg, loop.mass_kg},
          {down(1 - ratio_error), up(1 + ratio_error)},
          {0, 0},
          {loop.delay_s, loop.delay_s}};
}

template <class AnyLoop>
ThrustRatioGains gains_of(const AnyLoop& loop, Channel channel, double ratio_error) {
  ThrustRatioGains gains;
  const GainNorms of_force = norms_of(loop, Channel::kForce);
  gains.of_class = largest(uncertain_norms(loop, ratio_only(plant_of(loop), ratio_error), channel));
  const double by_feedback = ratio_error * effort_gain(loop);
  gains.force_per_N = by_feedback < 1 ? ratio_error / (1 - by_feedback) : kInfinity;
  gains.amplitude = of_force.amplitude;
  gains.edge = of_force.edge;
  return gains;
}

/// Returns sup |int e dt| per newton of force.
double integral_gain(const AxisLoop& loop) { return continuous_norms(loop, Channel::kForce).rate; }
double integral_gain(const SampledLoop& loop) {
  const SampledAdjoint adjoint(loop, SampledAdjoint::Output::kIntegral);
  if (!adjoint.is_stable()) return kInfinity;
  return force_gains(adjoint, adjoint.output_after_control(0)).amplitude / loop.plant.mass_kg;
}

template <class AnyLoop>
double demand_m_s(const AnyLoop& loop, const ThrustRatioGains& gains, const Disturbance& known,
                  const OtherErrors& errors) {
  OtherErrors constant;
  constant.bias_N = errors.thrust_ratio_error * errors.hover_N;
  const double feedback_N =
      effort_N(loop, with_hover_share(errors)) + times_known(effort_gain(loop), known.amplitude_N);
  const double constant_m_s = constant.bias_N == 0 ? 0 : integral_demand_m_s(loop, Channel::kForce, constant);
  return constant_m_s + (feedback_N == 0 ? 0 : integral_gain(loop) * gains.force_per_N * feedback_N);
}

template <class AnyLoop>
ClampBounds clamped(const AnyLoop& loop, Channel channel, const ClampBounds& exact,
                    const ThrustRatioGains& of_class, const Disturbance& known, const OtherErrors& errors,
                    double limit_m_s) {
  ClampBounds result = exact;
  if (!result.exists) return result;
  result.set_demand(exact.demand_m_s + demand_m_s(loop, of_class, known, errors), limit_m_s);
  AnyLoop without = loop;
  AxisLoop& plant = plant_of(without);
  const double ratio_error = errors.thrust_ratio_error;
  const double integral_N = (1 + ratio_error) * plant.mass_kg * plant.Ki * limit_m_s;
  plant.Ki = 0;
  const ThrustRatioGains gains = thrust_ratio_gains(without, channel, ratio_error);
  const ThrustRatioGains command =
      channel == Channel::kCommand ? gains : thrust_ratio_gains(without, Channel::kCommand, ratio_error);
  const double constant_m = command.of_class.amplitude * integral_N +
                            error_parts(without, gains.of_class.edge, errors).total_m() +
                            thrust_ratio_part(gains, errors, effort_N(without, with_hover_share(errors)));
  result.by_amplitude = times_known(gains.of_class.amplitude, known.amplitude_N) + constant_m;
  result.by_impulse = times_known(gains.of_class.impulse * known.passes, known.impulse_N_s) + constant_m;
  return result;
}

}  // namespace

ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const ClampBounds& exact,
                         const ThrustRatioGains& of_class, const Disturbance& known,
                         const OtherErrors& errors, double limit_m_s) {
  return clamped(loop, channel, exact, of_class, known, errors, limit_m_s);
}

ClampBounds clamp_bounds(const SampledLoop& loop, Channel channel, const ClampBounds& exact,
                         const ThrustRatioGains& of_class, const Disturbance& known,
                         const OtherErrors& errors, double limit_m_s) {
  return clamped(loop, channel, exact, of_class, known, errors, limit_m_s);
}

ThrustRatioGains thrust_ratio_gains(const AxisLoop& loop, Channel channel, double ratio_error) {
  return gains_of(loop, channel, ratio_error);
}

ThrustRatioGains thrust_ratio_gains(const SampledLoop& loop, Channel channel, double ratio_error) {
  return gains_of(loop, channel, ratio_error);
}

DisturbanceBounds disturbance_bounds(const ThrustRatioGains& gains, const Disturbance& disturbance) {
  DisturbanceBounds bounds;
  bounds.by_rate = times_known(gains.of_class.rate, disturbance.rate_N_s);
  bounds.by_amplitude = times_known(gains.of_class.amplitude, disturbance.amplitude_N);
  // An endless sequence of windows has unlimited total variation.
  if (!disturbance.variation_per_pass)
    bounds.by_edges = times_known(gains.of_class.edge, disturbance.variation_N);
  bounds.by_impulse = times_known(gains.of_class.impulse * disturbance.passes, disturbance.impulse_N_s);
  bounds.by_both = std::min(bounds.by_rate, bounds.by_amplitude);
  return bounds;
}

double thrust_ratio_part(const ThrustRatioGains& gains, const OtherErrors& errors, double errors_N) {
  const double constant_N = errors.thrust_ratio_error * errors.hover_N;
  const double feedback_N = errors_N == 0 ? 0 : gains.force_per_N * errors_N;
  return (constant_N == 0 ? 0 : gains.edge * constant_N) +
         (feedback_N == 0 ? 0 : gains.amplitude * feedback_N);
}

OtherErrors with_hover_share(OtherErrors errors) {
  errors.bias_N = std::abs(errors.bias_N) + errors.thrust_ratio_error * errors.hover_N;
  errors.start_N = errors.start_N + errors.thrust_ratio_error * errors.hover_N;
  return errors;
}

}  // namespace swarmcert::stability

#include "stability/bounds/loops/axis_loop.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::stability {
namespace {

Polynomial lag_polynomial(const AxisLoop& loop) {
  Polynomial result = {1};
  for (const double tau : loop.lags_s) {
    if (tau > 0) result = product(result, {1, tau});
  }
  return result;
}

Polynomial times_s(Polynomial p) {
  p.insert(p.begin(), 0.0);
  return p;
}

/// Returns numerator over D(s), without the factor s of D(s) if Ki = 0; `numerator` must then have one factor s less as
/// well.
TransferFunction over_characteristic(const AxisLoop& loop, Polynomial numerator) {
  const bool integrates = loop.Ki > 0;
  Polynomial open = lag_polynomial(loop);
  for (int i = integrates ? 0 : 1; i < 3; ++i) open = times_s(std::move(open));
  Polynomial feedback = integrates ? Polynomial{loop.Ki, loop.Kp, loop.Kd} : Polynomial{loop.Kp, loop.Kd};
  return {std::move(numerator), std::move(open), std::move(feedback), loop.delay_s};
}

Polynomial channel_numerator(const AxisLoop& loop, Channel channel) {
  return scaled(channel == Channel::kForce ? lag_polynomial(loop) : Polynomial{1}, 1 / loop.mass_kg);
}

/// Returns -u of the feedback after an impulse of force or command, without the delay's shift.
TransferFunction effort_transfer(const AxisLoop& loop, Channel channel) {
  const Polynomial feedback =
      loop.Ki > 0 ? Polynomial{loop.Ki, loop.Kp, loop.Kd} : Polynomial{loop.Kp, loop.Kd};
  return over_characteristic(loop,
                             channel == Channel::kForce ? product(feedback, lag_polynomial(loop)) : feedback);
}

/// Returns (p - p[0]) / s.
Polynomial without_constant(Polynomial p) {
  p.erase(p.begin());
  return p;
}

}  // namespace

TransferFunction step_transfer(const AxisLoop& loop, Channel channel) {
  TransferFunction h = over_characteristic(loop, channel_numerator(loop, channel));
  if (loop.Ki == 0) h.denominator = times_s(h.denominator), h.feedback = times_s(h.feedback);
  return h;
}

TransferFunction impulse_transfer(const AxisLoop& loop, Channel channel) {
  Polynomial numerator = channel_numerator(loop, channel);
  return over_characteristic(loop, loop.Ki > 0 ? times_s(std::move(numerator)) : std::move(numerator));
}

GainNorms continuous_norms(const AxisLoop& loop, Channel channel) {
  if (loop.Ki > 0) {
    const ResponseNorms h = response_norms(step_transfer(loop, channel));
    return {h.integral_abs, h.variation, h.max_abs(), h.slope_max_abs};
  }
  const ResponseNorms impulse = response_norms(impulse_transfer(loop, channel));
  return {kInfinity, impulse.integral_abs, impulse.step_max_abs, impulse.max_abs()};
}

GainNorms continuous_norms(const AxisLoop& loop, Estimate estimate) {
  if (estimate == Estimate::kVelocity) {
    GainNorms norms = continuous_norms(loop, Channel::kCommand);
    for (const auto gain : {&GainNorms::rate, &GainNorms::amplitude, &GainNorms::edge, &GainNorms::impulse}) {
      norms.*gain *= loop.mass_kg * loop.Kd;
    }
    return norms;
  }
  const ResponseNorms impulse = response_norms(position_error_transfer(loop));
  return {kInfinity, impulse.integral_abs, impulse.step_max_abs, impulse.max_abs()};
}

TransferFunction position_error_transfer(const AxisLoop& loop) {
  return over_characteristic(loop, loop.Ki > 0 ? Polynomial{loop.Ki, loop.Kp} : Polynomial{loop.Kp});
}

TransferFunction initial_position_transfer(const AxisLoop& loop) {
  Polynomial numerator = times_s(lag_polynomial(loop));
  numerator[0] += loop.Kd;
  return over_characteristic(loop, loop.Ki > 0 ? times_s(std::move(numerator)) : std::move(numerator));
}

LagFloor lag_floor(const AxisLoop& loop) {
  if (!is_stable(loop)) return {kInfinity, kInfinity};
  const Polynomial rest = without_constant(lag_polynomial(loop));
  LagFloor floor;
  if (!rest.empty()) {
    const Polynomial over_mass = scaled(rest, 1 / loop.mass_kg);
    const ResponseNorms lagged =
        response_norms(over_characteristic(loop, loop.Ki > 0 ? times_s(over_mass) : over_mass));
    floor = {lagged.integral_abs, lagged.slope_max_abs};
  }
  if (loop.delay_s > 0) {
    // L - e^(-Ts) = (L - 1) + (1 - e^(-Ts)), and (1 - e^(-Ts))/s is T times the mean over a window; the triangle
    // inequality gives a bound, which is no longer exact.
    const ResponseNorms command = response_norms(impulse_transfer(loop, Channel::kCommand));
    floor.rate += loop.delay_s * command.integral_abs;
    floor.impulse += command.max - command.min;
  }
  return floor;
}

double effort_gain(const AxisLoop& loop, Channel channel) {
  return (channel == Channel::kCommand ? 1 : 0) + response_norms(effort_transfer(loop, channel)).integral_abs;
}

double effort_impulse_gain(const AxisLoop& loop, Channel channel) {
  return response_norms(effort_transfer(loop, channel)).max_abs();
}

RateGains rate_gains(const AxisLoop& loop) {
  if (loop.Ki == 0) return {kInfinity, kInfinity, kInfinity};
  const ResponseNorms h = response_norms(step_transfer(loop, Channel::kCommand));
  return {h.integral_abs, h.variation, h.curvature_integral};
}

bool is_stable(const AxisLoop& loop) { return is_stable(impulse_transfer(loop, Channel::kForce)); }

double lag_limit(const AxisLoop& loop) {
  if (!is_stable(loop)) return 0;
  AxisLoop lagged = loop;
  lagged.lags_s.erase(std::remove(lagged.lags_s.begin(), lagged.lags_s.end(), 0.0), lagged.lags_s.end());
  if (lagged.lags_s.empty() && loop.delay_s == 0) {
    const double limit = (loop.Kd - loop.Ki / loop.Kp) / loop.Kp;
    return limit;
  }
  lagged.lags_s.push_back(0);
  const auto holds = [&lagged](double tau) {
    lagged.lags_s.back() = tau;
    return is_stable(lagged);
  };
  double low = 0;
  double high = 1e-3;
  while (holds(high)) {
    low = high;
    high *= 2;
    if (high > 1e6) return kInfinity;
  }
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

double delay_limit(const AxisLoop& loop) {
  const TransferFunction y = impulse_transfer(loop, Channel::kForce);
  return delay_margin(y.denominator, y.feedback);
}

double clamp_residual(const AxisLoop& loop, double bias_N, double limit_m_s) {
  if (std::isinf(limit_m_s) && loop.Ki > 0) return 0;
  const double kept = loop.Ki > 0 ? loop.Ki * limit_m_s : 0;
  return std::max(0.0, std::abs(bias_N) / loop.mass_kg - kept) / loop.Kp;
}

}  // namespace swarmcert::stability

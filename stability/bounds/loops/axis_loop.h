/// @file One axis of the position loop: its transfer functions and the gains from disturbance to tracking error.
#pragma once

#include <string>
#include <vector>

#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// One axis with m e'' = f_applied + f, where f_applied is the command -m (Kp e + Kd e' + Ki int e) behind first-order
/// lags and a delay. The characteristic function is D(s) = L(s) s^3 + (Kd s^2 + Kp s + Ki) exp(-delay s), L the product
/// of (tau s + 1).
struct AxisLoop {
  double mass_kg = 0;
  double Kp = 0;               ///< 1/s^2
  double Kd = 0;               ///< 1/s
  double Ki = 0;               ///< 1/s^3, effective (see effective_Ki())
  std::vector<double> lags_s;  ///< time constants; zeros are skipped
  double delay_s = 0;
  bool operator==(const AxisLoop& o) const {
    return mass_kg == o.mass_kg && Kp == o.Kp && Kd == o.Kd && Ki == o.Ki && lags_s == o.lags_s &&
           delay_s == o.delay_s;
  }
};

/// The point at which a force error enters.
enum class Channel {
  kForce,    ///< on the mass, uncompensated: m D e = s L f
  kCommand,  ///< in the command, through the motors: m D e = -s eps (times the delay, which norms ignore)
};

/// The estimate that has an error.
enum class Estimate {
  kVelocity,  ///< the law sees e' + n: the command has the error -m Kd n
  kPosition,  ///< the law sees e + n, also in the integral: the command has the error -m (Kp n + Ki int n)
};

/// Worst tracking error per unit of disturbance f: for |f'| <= 1 N/s, |f| <= 1 N, total variation of f 1 N, and int |f|
/// dt = 1 N s. `rate` is infinite for Ki = 0; all are infinite if the loop is unstable.
struct GainNorms {
  double rate = 0;       ///< |h|_1, m per N/s, where m D e = s f and h is the response to a unit step of f
  double amplitude = 0;  ///< |h'|_1, m/N
  double edge = 0;       ///< |h|_oo, m/N
  double impulse = 0;    ///< |h'|_oo, m per N s
};

/// Returns the exact norms of the continuous loop (up to round-off, see response_norms()).
GainNorms continuous_norms(const AxisLoop& loop, Channel channel);

/// The same for an error n of an estimate in place of f, per m/s or per m: for |n'| <= 1, |n| <= 1, total variation of
/// n 1, int |n| dt = 1. e is the true error. The vehicle follows a constant position error, so its `rate` is infinite.
GainNorms continuous_norms(const AxisLoop& loop, Estimate estimate);

/// Returns h' of `channel`, m per N s: the error after a unit impulse of force.
TransferFunction impulse_transfer(const AxisLoop& loop, Channel channel);
/// Returns h of `channel`, m/N. It decays only if Ki > 0.
TransferFunction step_transfer(const AxisLoop& loop, Channel channel);

/// Returns -e after an impulse of an error of the estimated position, without the delay's shift: (Kp s + Ki)/D.
TransferFunction position_error_transfer(const AxisLoop& loop);
/// Returns (s^2 L + s Kd)/D: without a delay, e after e(0) = 1, e'(0) = 0 with lags at rest and zero integral; starts
/// at 1.
TransferFunction initial_position_transfer(const AxisLoop& loop);

/// The error that remains with a perfect feedforward of f_a, because the feedforward passes the lag and the delay:
/// |e| <= rate sup|f_a' - m p_d'''|, and |e| <= impulse int|f_a| dt. Exact without a delay, upper bounds with one.
struct LagFloor {
  double rate = 0;     ///< |h_force - h_command|_1, m per N/s
  double impulse = 0;  ///< |h'_force - h'_command|_oo, m per N s
};
LagFloor lag_floor(const AxisLoop& loop);

/// Returns |u|_oo per |f|_oo for the commanded force u beside weight and feedforward, N/N: the feedback, and for
/// kCommand the error of the command itself.
double effort_gain(const AxisLoop& loop, Channel channel = Channel::kForce);

/// Returns sup |u| of the feedback after an impulse of 1 N s, N per N s.
double effort_impulse_gain(const AxisLoop& loop, Channel channel = Channel::kForce);

/// Gains from |eps'| <= 1 N/s in the command to e, e' and e'': g0, g1, g2 of a small-gain argument.
struct RateGains {
  double position = 0;      ///< |h|_1
  double velocity = 0;      ///< |h'|_1
  double acceleration = 0;  ///< |h''|_1
};
RateGains rate_gains(const AxisLoop& loop);

/// Returns the largest additional first-order lag (with the other lags as given) below which the loop is stable.
/// Without other lags and delay it is (Kd - Ki/Kp)/Kp (Routh). 0 if the loop is unstable without it; infinite if no lag
/// destabilises it.
double lag_limit(const AxisLoop& loop);

/// Returns the largest delay with which the loop is stable.
double delay_limit(const AxisLoop& loop);

bool is_stable(const AxisLoop& loop);

/// Returns the error, in m, that remains under a constant force bias that an integrator limited to |int e| <= limit
/// cannot cancel: max(0, |bias|/m - Ki limit)/Kp.
double clamp_residual(const AxisLoop& loop, double bias_N, double limit_m_s);

}  // namespace swarmcert::stability

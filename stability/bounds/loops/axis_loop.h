/// @file One axis of the position loop: its transfer functions and the gains from disturbance to tracking error.
#pragma once

#include <string>
#include <vector>

#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// m e'' = f_applied + f, with f_applied the command -m (Kp e + Kd e' + Ki int e) behind first-order lags and a delay.
/// The characteristic function is D(s) = L(s) s^3 + (Kd s^2 + Kp s + Ki) exp(-delay s), L the product of (tau s + 1).
struct AxisLoop {
  double mass_kg = 0;
  double Kp = 0;               ///< 1/s^2
  double Kd = 0;               ///< 1/s
  double Ki = 0;               ///< 1/s^3, as it acts (see effective_Ki())
  std::vector<double> lags_s;  ///< time constants; zeros are skipped
  double delay_s = 0;
};

/// Where a force error enters.
enum class Channel {
  kForce,    ///< on the mass, uncompensated: m D e = s L f
  kCommand,  ///< in the command, through the motors: m D e = -s eps (times the delay, which norms do not see)
};

/// Which estimate that the law is given is wrong.
enum class Estimate {
  kVelocity,  ///< the law sees e' + n: the command errs by -m Kd n
  kPosition,  ///< the law sees e + n, its integral too: the command errs by -m (Kp n + Ki int n)
};

/// Worst tracking error per unit of disturbance f: for |f'| <= 1 N/s, |f| <= 1 N, total variation of f 1 N, and
/// int |f| dt = 1 N s. `rate` is infinite for Ki = 0; all are where the loop is unstable.
struct GainNorms {
  double rate = 0;       ///< |h|_1, m per N/s, where m D e = s f and h is the response to a unit step of f
  double amplitude = 0;  ///< |h'|_1, m/N
  double edge = 0;       ///< |h|_oo, m/N
  double impulse = 0;    ///< |h'|_oo, m per N s
};

/// Exact norms of the continuous loop (to rounding, see response_norms()).
GainNorms continuous_norms(const AxisLoop& loop, Channel channel);

/// The same for an error n of an estimate in place of f, per m/s or per m: for |n'| <= 1, |n| <= 1, total variation of
/// n 1, int |n| dt = 1. e is the true error. A constant error of the position is followed, so its `rate` is infinite.
GainNorms continuous_norms(const AxisLoop& loop, Estimate estimate);

/// sup h - inf h: worst error of one pulse of unit amplitude that rises once and falls once, m/N.
double pulse_gain(const AxisLoop& loop, Channel channel);

/// h' of `channel`, m per N s: the error after a unit impulse of force.
TransferFunction impulse_transfer(const AxisLoop& loop, Channel channel);
/// h of `channel`, m/N. Needs Ki > 0 to decay.
TransferFunction step_transfer(const AxisLoop& loop, Channel channel);

/// -e after an impulse of an error of the estimated position, without the delay's shift: (Kp s + Ki)/D.
TransferFunction position_error_transfer(const AxisLoop& loop);
/// (s^2 L + s Kd)/D: without a delay e after e(0) = 1, e'(0) = 0 with lags at rest and no integral; starts at 1.
TransferFunction initial_position_transfer(const AxisLoop& loop);

/// What remains with a perfect feed-forward of f_a, because it passes the lag and the delay:
/// |e| <= rate sup|f_a' - m p_d'''|, and |e| <= impulse int|f_a| dt. Exact without a delay, bounds with one.
struct LagFloor {
  double rate = 0;     ///< |h_force - h_command|_1, m per N/s
  double impulse = 0;  ///< |h'_force - h'_command|_oo, m per N s
};
LagFloor lag_floor(const AxisLoop& loop);

/// |u|_oo per |f|_oo for the feedback part u of the commanded force, N/N (force channel).
double effort_gain(const AxisLoop& loop);

/// sup |u| after an impulse of force of 1 N s, N per N s.
double effort_impulse_gain(const AxisLoop& loop);

/// What |eps'| <= 1 N/s in the command does to e, e' and e'': g0, g1, g2 of a small-gain argument.
struct RateGains {
  double position = 0;      ///< |h|_1
  double velocity = 0;      ///< |h'|_1
  double acceleration = 0;  ///< |h''|_1
};
RateGains rate_gains(const AxisLoop& loop);

/// Largest additional first-order lag (at the given others) below which the loop is stable; for no other lag and no
/// delay it is (Kd - Ki/Kp)/Kp (Routh). 0 if it is unstable without; infinite if no lag destabilises it.
double lag_limit(const AxisLoop& loop);

/// Largest delay with which the loop is stable.
double delay_limit(const AxisLoop& loop);

bool is_stable(const AxisLoop& loop);

/// A constant force bias that an integrator limited to |int e| <= limit cannot cancel leaves
/// max(0, |bias|/m - Ki limit)/Kp of error, in m.
double clamp_residual(const AxisLoop& loop, double bias_N, double limit_m_s);

}  // namespace swarmcert::stability

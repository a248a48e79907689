/// @file The tracking error of a sampled loop due to the jerk of its setpoint. Not for users.
#pragma once

#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// Returns the largest age of the reference acceleration that acts, averaged by the lags: the sum of lags and delay
/// and, for a sampled loop, one period.
double acceleration_age_s(const AxisLoop& loop);
double acceleration_age_s(const SampledLoop& loop);

/// Returns sup |e| per unit of sup |p_d'''|, m per m/s^3, at and between the samples, from rest with p_d'' = 0.
///
/// The firmware adds a(t_k), a = p_d'', to its command once per period. Hence -a disturbs the mass at all times, and
/// a(t_k) the command at its samples: with F the kernel of a force and C_k that of a command, both per unit of
/// acceleration,
///   e(t) = -int F(u) a(t - u) du + sum_k C_k a(t_k) = int (C(u) - H(u)) a'(t - u) du,
/// where H is the integral of F up to u, and C the sum of the C_k of samples at most u old. The gain at one phase of
/// the period is therefore int |C - H|, attained by jerk of constant magnitude and switching sign; hold, delay and lags
/// are contained in both kernels.
///
/// Nine phases are evaluated. Between two of them e deviates from its chord by at most an eighth of the squared step
/// times |e''|, and |e''| <= (acceleration_age_s() + the gain to the feedback's command) |p_d'''|, which is added.
/// Infinite if the loop is unstable.
double jerk_gain(const SampledLoop& loop);
/// The same for a continuous loop: lag_floor().rate per unit of acceleration.
double jerk_gain(const AxisLoop& loop);

}  // namespace swarmcert::stability

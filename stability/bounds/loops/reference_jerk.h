/// @file The tracking error that a sampled loop owes to the jerk of its set point. Not for users.
#pragma once

#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// How old the reference's acceleration that acts is at most, on average over what the lags let through: lags, delay
/// and, of a sampled loop, one period.
double acceleration_age_s(const AxisLoop& loop);
double acceleration_age_s(const SampledLoop& loop);

/// sup |e| per unit of sup |p_d'''|, m per m/s^3, at and between the samples, from rest with p_d'' = 0.
///
/// Firmware adds a(t_k), a = p_d'', to its command once per period. So -a disturbs the mass at all times and the
/// command by a(t_k) at its samples: with F the kernel of a force and C_k that of a command, both per unit of
/// acceleration,
///   e(t) = -int F(u) a(t - u) du + sum_k C_k a(t_k) = int (C(u) - H(u)) a'(t - u) du,
/// H the integral of F up to u, and C the sum of the C_k of samples at most u old. The gain at one phase of the period
/// is therefore int |C - H|, reached by jerks of one size and either sign; hold, delay and lags are in both kernels.
///
/// Nine phases are evaluated. Between two of them e leaves its chord by at most an eighth of the squared step times
/// |e''|, and |e''| <= (acceleration_age_s() + the gain to the feedback's command) |p_d'''|, which is added.
/// Infinite where the loop is not stable.
double jerk_gain(const SampledLoop& loop);

}  // namespace swarmcert::stability

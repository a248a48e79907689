/// @file Rigorous enclosures of the norms of an impulse response.
#pragma once

#include <array>
#include <optional>

#include "nn/base/interval.h"
#include "stability/bounds/loops/axis_loop.h"

namespace swarmcert::stability {

/// Each interval contains the exact value, in real arithmetic, for the transfer function whose coefficients are the
/// doubles of step_transfer() (without Ki: impulse_transfer()). Mass and products of lags are rounded once each in
/// these coefficients.
struct VerifiedNorms {
  Interval rate, amplitude, edge, impulse;
  double delay_gain = 0;  ///< with a delay, about half the relative width of the enclosures
};
inline constexpr std::array<Interval VerifiedNorms::*, 4> kVerifiedGains = {
    &VerifiedNorms::rate, &VerifiedNorms::amplitude, &VerifiedNorms::edge, &VerifiedNorms::impulse};

/// Encloses the gains of a loop; without Ki the rate gain is infinite. Returns nothing if stability could not be
/// verified.
///
/// Coordinates w = R x are chosen such that the symmetric part of A = R companion R^-1 is verified to lie below -alpha
/// I (interval Cholesky). Then |exp(At)|_2 <= e^(-alpha t), so errors of the computed trajectory never grow, and its
/// tail is bounded by |w(T)|/alpha. Each step multiplies by an approximate matrix exponential; its error, including
/// round-off, is bounded per step by interval Taylor coefficients with remainder, and summed. Between steps the
/// response is its Taylor polynomial; segments on which its sign is uncertain are halved, down to 2^-30 of a step.
///
/// A delay T is treated by the method of steps, verified a posteriori (verified_delay.h). If that takes many segments
/// because the delay is short compared with the slowest mode, an expansion is tried first: e^(-Ts) = R(s) + rest, with
/// R the Taylor polynomial of the highest degree k for which D0 = denominator + feedback R is no less proper, one per
/// lag. The rest is (-s)^(k+1) int_0^T (T - u)^k/k! e^(-us) du (Taylor), a kernel of one sign and of norm
/// T^(k+1)/(k+1)! behind k + 1 derivatives. With lambda = T^(k+1)/(k+1)! |s^(k+1) feedback/D0|_1 (a jump at 0 counts)
/// the true response y is y0 - k * y, y0 that of D0 and |k|_1 <= lambda: if lambda < 1 the loop is stable (Neumann
/// series), and every norm of y lies between those of y0 over 1 + lambda and over 1 - lambda. Lower degrees are tried
/// if lambda is above 0.001.
std::optional<VerifiedNorms> verified_norms(const AxisLoop& loop, Channel channel);

/// The same for errors of an estimate, as in continuous_norms(): for the doubles of position_error_transfer(), or those
/// of the command channel times m Kd.
std::optional<VerifiedNorms> verified_norms(const AxisLoop& loop, Estimate estimate);

}  // namespace swarmcert::stability

/// @file The difference between a sampled and a continuous position loop, as a bounded force.
#pragma once

#include "analysis/tracking/tube/error_loops.h"

namespace swarmcert::analysis {

/// One axis up to some time: suprema over all earlier times.
struct LoopHistory {
  double position_m = 0, velocity_m_s = 0;  ///< |e|, |e'|
  double time_s = 0;

  void add(const LoopHistory& later);  ///< entrywise maximum
};

/// Bounds on one axis over a slice and the period of the loop before it.
struct HeldSlice {
  Interval velocity_m_s;                 ///< e'
  Interval acceleration_m_s2;            ///< e'' without the contribution of x in the slice itself
  Interval acceleration_before_m_s2;     ///< e'' over the period before
  LoopHistory history;                   ///< up to the end of the slice
  double largest_acceleration_m_s2 = 0;  ///< sup |e''| up to the slice's start
  Interval jerk_m_s3;                    ///< p_d'''
  double per_N = 0;                      ///< contribution to |e''| in the slice of |m x| <= 1 N in the slice
  /// The same for |m x| <= (t - t_k)/T 1 N, where t_k is the last sample; at most per_N
  double per_rising_N = 0;
};

/// Enclosures of m x and e'' in a slice.
struct HeldAnswer {
  Interval hold_N, acceleration_m_s2;  ///< enclosures
  /// For the kernels, m x acts like this force plus a sawtooth of mean 0 whose integral is at most sawtooth_N_s; see
  /// ErrorLoop::has_whole_periods. If cells do not span whole periods, it equals hold_N and there is no sawtooth.
  Interval mean_N;
  double sawtooth_N_s = 0;
};

/// The command of the sampled loop of error_loops.h is computed at t_k = k T, k = 0, 1, .., and held for
/// t_k <= t < t_k + T:
///   c_k = Kp e(t_k) + Kd e'(t_k) + Ki T sum_{j <= k} e(t_j),   x(t) = c(t) - c_k + p_d''(t_k) - p_d''(t),
/// with c the continuous law and Ki the effective integral gain. With e(0) = 0,
///   T sum_{j <= k} e(t_j) - int_0^{t_k} e = T e(t_k)/2 + R,   |R| <= (T^2/12) t_k sup|e''|,
/// the error of the trapezoidal rule; together with int_{t_k}^t e that is at most T/2 sup|e| + T^2/2 sup|e'| + |R|.
/// Hence, since c(t) - c(t_k) = int_{t_k}^t (Kp e' + Kd e'') + the part of the integral,
///   x(t) lies in (t - t_k) Y + [-1, 1] Ki (T/2 sup|e| + (T^2/2) sup|e'| + |R|),
///   Y = Kp E' + Kd E'' - J,
/// with E', E'' and J intervals of e', e'' and p_d''' over the slice and the period before it. The contribution of x to
/// E'' in its own slice is solved for. All results are infinite if no bound is known.
HeldAnswer hold_error(const ErrorLoop& loop, const HeldSlice& slice);

/// Upper bound in m s on the excess of the firmware's sum T sum e(t_j) over the largest |int e|; 0 if the loop is
/// continuous.
double sum_excess_m_s(const ErrorLoop& loop, const LoopHistory& history, double acceleration_m_s2);

}  // namespace swarmcert::analysis

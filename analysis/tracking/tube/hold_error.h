/// @file What a sampled position loop does that the continuous one does not, as a bounded force.
#pragma once

#include "analysis/tracking/tube/error_loops.h"

namespace swarmcert::analysis {

/// One axis up to some time: suprema over all times before.
struct LoopHistory {
  double position_m = 0, velocity_m_s = 0;  ///< |e|, |e'|
  double force_N = 0;  ///< |f_hat - f_a| along z, |f_a| along x and y: the force that kernels h see
  double truth_N = 0;  ///< |f_a|
  double planned_m_s2 = 0, jerk_m_s3 = 0;  ///< |p_d''|, |p_d'''|
  double time_s = 0;
  double of_estimates_m_s2 = 0;  ///< what errors of the estimates add to |e''|

  void add(const LoopHistory& later);  ///< the larger of both, entry by entry
};

/// Bounds m |x(t)|, N, of the sampled loop of error_loops.h: what the command held at t differs from the continuous
/// law's at t. 0 where the loop is continuous, infinite where nothing is known.
///
/// Let the command be computed at t_k = k T, k = 0, 1, .., and held for t_k <= t < t_k + T:
///   c_k = Kp e(t_k) + Kd e'(t_k) + Ki T sum_{j <= k} e(t_j),   x(t) = c(t) - c_k + p_d''(t_k) - p_d''(t),
/// with c the continuous law and Ki as it acts. The first two terms of c differ by at most T sup|e'|, T sup|e''| times
/// their gains. With e(0) = 0,
///   T sum_{j <= k} e(t_j) - int_0^{t_k} e = T e(t_k)/2 + R,   |R| <= (T^2/12) t_k sup|e''|,
/// the error of the trapezoidal rule; together with int_{t_k}^t e that is at most T/2 sup|e| + T^2/2 sup|e'| + |R|.
/// So |x| <= a + b sup|e''| with a and b known. In turn the loop's kernels give sup|e''| <= p + q sup|x| (both suprema
/// up to t, and finite), so that where b q < 1
///   sup|x| <= (a + b p)/(1 - b q).
/// @param planned_at_start_m_s2 at least |p_d''(0)|; p_d'' is continuous from then on.
/// @param excess_N at least |thrust - weight| of rotors at t = 0 (LagStart); 0 without a lag.
double hold_error_N(const ErrorLoop& loop, const LoopHistory& history, double planned_at_start_m_s2,
                    double excess_N);

/// What is known of one axis over a slice and a period of the loop before it.
struct HeldSlice {
  Interval velocity_m_s;                 ///< e'
  Interval acceleration_m_s2;            ///< e'' without what x adds in the slice itself
  Interval acceleration_before_m_s2;     ///< e'' over the period before
  LoopHistory history;                   ///< up to the end of the slice
  double largest_acceleration_m_s2 = 0;  ///< sup |e''| up to the slice's start
  Interval jerk_m_s3;                    ///< p_d'''
  double per_N = 0;                      ///< what |m x| <= 1 N in the slice adds to |e''| in it
  /// The same of |m x| <= (t - t_k)/T 1 N, where t_k is the last sample; at most per_N
  double per_rising_N = 0;
};

/// What is known of m x and e'' in a slice.
struct HeldAnswer {
  Interval hold_N, acceleration_m_s2;  ///< contain them
  /// To the kernels m x is this force and a sawtooth of mean 0, whose integral is at most sawtooth_N_s: see
  /// ErrorLoop::has_whole_periods. Where cells are no whole periods it is hold_N, without a sawtooth.
  Interval mean_N;
  double sawtooth_N_s = 0;
};

/// The same bound slice by slice and with its sign: as c(t) - c(t_k) = int_{t_k}^t (Kp e' + Kd e'') + the integral's
/// part,
///   x(t) lies in (t - t_k) Y + [-1, 1] Ki (T/2 sup|e| + (T^2/2) sup|e'| + |R|),
///   Y = Kp E' + Kd E'' - J,
/// E', E'' and J intervals of e', e'' and p_d''' over the slice and a period before it. What x adds to E'' in its
/// own slice is solved for as above. All are infinite where nothing is known.
HeldAnswer hold_error(const ErrorLoop& loop, const HeldSlice& slice);

/// At least what the firmware's sum T sum e(t_j) exceeds the largest |int e| by, m s; 0 where the loop is continuous.
double sum_excess_m_s(const ErrorLoop& loop, const LoopHistory& history, double acceleration_m_s2);

}  // namespace swarmcert::analysis

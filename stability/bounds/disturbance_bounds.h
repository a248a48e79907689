/// @file Bounds on the tracking error of one axis from what is known of a force error, and the smallest of them.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "stability/bounds/axis_loop.h"

namespace swarmcert::stability {

/// What is known of the force error f(t) of one axis. Infinite: nothing. f is zero before it starts.
struct Disturbance {
  double rate_N_s = std::numeric_limits<double>::infinity();     ///< sup |f'|
  double amplitude_N = std::numeric_limits<double>::infinity();  ///< sup |f|
  double variation_N = std::numeric_limits<double>::infinity();  ///< total variation of f
  double impulse_N_s = std::numeric_limits<double>::infinity();  ///< int |f| dt, of one pass
  int passes = 1;                                                ///< how many such passes
  double pass_period_s = 0;  ///< least time from the start of one pass to the start of the next
  double pass_length_s = 0;  ///< how long one pass lasts
};

/// Bounds on sup |e|, m. Infinite where a number is not known.
struct DisturbanceBounds {
  double by_rate = std::numeric_limits<double>::infinity();       ///< B1 = |h|_1 sup|f'|
  double by_amplitude = std::numeric_limits<double>::infinity();  ///< B2 = |h'|_1 sup|f|
  double by_edges = std::numeric_limits<double>::infinity();      ///< B3 = |h|_oo TV(f)
  /// B4 = sum over the passes of impulse times sup |h'| over the times at which that pass can still be felt
  double by_impulse = std::numeric_limits<double>::infinity();
  /// B5: amplitude and rate together; at most min(B1, B2). See amplitude_and_rate_bound().
  double by_both = std::numeric_limits<double>::infinity();

  double least() const;
  /// "rate", "amplitude", "edges", "impulse" or "amplitude and rate"; "none" where nothing is known.
  std::string which() const;
};

/// What the gains alone give, of a continuous or a sampled loop: every pass counts in full, B5 = min(B1, B2).
DisturbanceBounds disturbance_bounds(const GainNorms& gains, const Disturbance& disturbance);

/// The same of a continuous loop with its kernel: B5 is solved, and earlier passes count as far as they can still be felt.
DisturbanceBounds disturbance_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance);

/// What a clamp |int e| <= limit does to bounds of the linear continuous loop. For a sampled loop these are estimates.
struct ClampBounds {
  bool exists = false;  ///< whether there is a clamp, and an integrator that it could stop
  /// The integrator of the linear loop stays below this, m s: min(|h|_1 sup|f|, |h|_oo int|f|) plus |bias|/(m Ki).
  double demand_m_s = 0;
  /// Whether the demand is within the limit: then the clamp never acts, and bounds of the linear loop hold.
  bool never_acts = true;
  /// Holds whether it acts or not: the integral is a force of at most m Ki limit, which the loop without integral sees
  /// beside f. |h'_PD|_1 (m Ki limit + sup|f + bias|), or for impulses |h'_PD|_oo int|f| + |h'_PD|_1 (m Ki limit + |bias|).
  double by_amplitude = std::numeric_limits<double>::infinity();
  double by_impulse = std::numeric_limits<double>::infinity();
};

/// @param loop with the integral gain as it acts. @param integral_share what the firmware adds to its integrator per
///   second of error: 1 unless its step differs from its period. @param limit_m_s on that integrator; infinite: none.
ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance, double bias_N,
                         double integral_share, double limit_m_s);

/// sup |e| over all f with |f| <= amplitude and |f'| <= rate, from rest. It is a linear program in f; its dual is
///   min over u of  amplitude TV(u) + rate |h - u|_1,
/// a split of the kernel h: part of it sees f through its amplitude, the rest through its rate. Every u proves a bound.
/// The best u on a grid of `nodes` is found exactly (total-variation denoising by slope trick), its bound evaluated
/// with the interpolation error of h added.
double amplitude_and_rate_bound(const AxisLoop& loop, Channel channel, double amplitude_N, double rate_N_s,
                                int nodes = 6000);

/// sup |h'(t)| over t >= after_s, m per N s: what is left of an impulse of one newton second.
double impulse_gain_after(const AxisLoop& loop, Channel channel, double after_s);

/// The force of the class |f| <= 1 N that makes e(T) largest: sign of h'(T - t), at t = 0, step, ..., T.
std::vector<double> worst_amplitude_input(const AxisLoop& loop, Channel channel, double step_s, int count);

/// A staircase f_hat, updated every period and late by a latency, differs from its source by at most
/// (period + latency) sup|f_hat'|: split f = continuous part + staircase part and bound the latter by its amplitude.
/// @return m: |h'|_1 (1/rate_hz + latency_s) rate_of_f_hat_N_s
double staircase_error(const GainNorms& gains, double rate_hz, double latency_s, double rate_of_f_hat_N_s);

}  // namespace swarmcert::stability

/// @file Bounds on the tracking error of one axis for the declared class of disturbances, and the smallest of them.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "stability/bounds/error_parts.h"
#include "stability/bounds/loops/axis_loop.h"

namespace swarmcert::stability {

/// What is known of the force error f(t) of one axis. Infinite: nothing. f is zero before it starts.
struct Disturbance {
  double rate_N_s = std::numeric_limits<double>::infinity();     ///< sup |f'|
  double amplitude_N = std::numeric_limits<double>::infinity();  ///< sup |f|
  double variation_N =
      std::numeric_limits<double>::infinity();  ///< total variation of f, rise from zero included
  double impulse_N_s = std::numeric_limits<double>::infinity();  ///< int |f| dt, of one pass
  int passes = 1;                                                ///< how many such passes
  double pass_period_s = 0;  ///< least time from the start of one pass to the start of the next
  double pass_length_s = 0;  ///< how long one pass lasts
  /// Whether variation_N, too, is that of one pass, of a force that need not vanish between passes.
  bool variation_per_pass = false;
  bool operator==(const Disturbance& o) const {
    return rate_N_s == o.rate_N_s && amplitude_N == o.amplitude_N && variation_N == o.variation_N &&
           impulse_N_s == o.impulse_N_s && passes == o.passes && pass_period_s == o.pass_period_s &&
           pass_length_s == o.pass_length_s && variation_per_pass == o.variation_per_pass;
  }
  static constexpr int kManyPasses = 1000;  ///< stands for a flight of any length: older passes are not felt
};

/// factor * known, where "nothing known" stays infinite even for a factor of 0.
inline double times_known(double factor, double known) { return std::isinf(known) ? known : factor * known; }

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
  /// Adds what acts beside the class to the bound of every class.
  void add(double error_m);
  /// "rate", "amplitude", "edges", "impulse" or "amplitude and rate"; "none" where nothing is known.
  std::string which() const;
};

/// Of a continuous loop. Earlier passes count as far as they can still be felt.
DisturbanceBounds disturbance_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance);

/// What all passes together can do, per unit of one; empty: of a loop that is not stable.
struct FeltPasses {
  std::function<double()> impulses, edges;
};

/// Gains times what is known of each class, for the continuous and the sampled loop.
DisturbanceBounds bounds_by_class(const GainNorms& gains, const Disturbance& disturbance, bool has_integrator,
                                  const FeltPasses& felt);

/// sum over the passes of gain_after(time since the pass ended): what all of them together can do, per unit of one.
/// @param gain_after falls.
double felt_passes(const Disturbance& disturbance, const std::function<double(double)>& gain_after);

/// What a clamp |int e| <= limit does to bounds of the linear loop.
struct ClampBounds {
  bool exists = false;  ///< whether there is a clamp, and an integrator that it could stop
  /// The integrator of the linear loop stays below this, m s: the gain from f to int e, plus integral_demand_m_s().
  double demand_m_s = 0;
  /// Whether the demand is within the limit: then the clamp never acts, and bounds of the linear loop hold.
  bool never_acts = true;
  /// Holds whether it acts or not: the integral is a command of at most m Ki limit, which the loop without integral
  /// sees beside f. |h'_PD|_1 sup|f| + |c'_PD|_1 m Ki limit, c the command channel, or for impulses
  /// |h'_PD|_oo int|f| + |c'_PD|_1 m Ki limit, each with error_parts() of the loop without integral.
  double by_amplitude = std::numeric_limits<double>::infinity();
  double by_impulse = std::numeric_limits<double>::infinity();

  void set_demand(double value_m_s, double limit_m_s) {
    demand_m_s = value_m_s;
    never_acts = value_m_s <= limit_m_s;
  }
};

/// @param loop with the integral gain as it acts. @param limit_m_s infinite: none. @param integral_share what the
///   firmware adds to its integrator per second of error: 1 unless its step differs from its period. For a sampled
///   loop's own clamp see sampled_bounds.h.
ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s, double integral_share = 1);

/// sup |e| over all f with |f| <= amplitude and |f'| <= rate, from rest: split_bound() of h on a grid of `nodes`.
double amplitude_and_rate_bound(const AxisLoop& loop, Channel channel, double amplitude_N, double rate_N_s,
                                int nodes = 6000);

/// A staircase f_hat, updated every period and late by a latency, differs from its source by at most
/// (period + latency) sup|f_hat'|: split f = continuous part + staircase part and bound the latter by its amplitude.
/// @return m: |h'|_1 (1/rate_hz + latency_s) rate_of_f_hat_N_s
double staircase_error(const GainNorms& gains, double rate_hz, double latency_s, double rate_of_f_hat_N_s);

}  // namespace swarmcert::stability

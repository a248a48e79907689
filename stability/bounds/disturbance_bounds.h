/// @file Bounds on the tracking error of one axis for the declared classes of disturbances, and the smallest one.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "stability/bounds/error_parts.h"
#include "stability/bounds/loops/axis_loop.h"

namespace swarmcert::stability {

/// Known bounds on the force error f(t) of one axis. Infinite: unknown. f is zero before it starts.
struct Disturbance {
  double rate_N_s = std::numeric_limits<double>::infinity();     ///< sup |f'|
  double amplitude_N = std::numeric_limits<double>::infinity();  ///< sup |f|
  /// Total variation of f, rise from zero included.
  double variation_N = std::numeric_limits<double>::infinity();
  double impulse_N_s = std::numeric_limits<double>::infinity();  ///< int |f| dt, of one pass
  int passes = 1;                                                ///< number of such passes
  double pass_period_s = 0;  ///< least time from the start of one pass to the start of the next
  double pass_length_s = 0;  ///< duration of one pass
  /// True if variation_N is also that of one pass, for a force that need not vanish between passes.
  bool variation_per_pass = false;
  /// Returns the smallest bound on |f| that follows.
  double largest_N() const { return variation_per_pass ? amplitude_N : std::min(amplitude_N, variation_N); }
  bool operator==(const Disturbance& o) const {
    return rate_N_s == o.rate_N_s && amplitude_N == o.amplitude_N && variation_N == o.variation_N &&
           impulse_N_s == o.impulse_N_s && passes == o.passes && pass_period_s == o.pass_period_s &&
           pass_length_s == o.pass_length_s && variation_per_pass == o.variation_per_pass;
  }
  static constexpr int kManyPasses = 1000;  ///< stands for any number: older passes are no longer felt
};

/// Returns factor * known, where infinity (unknown) stays infinite even for a factor of 0.
inline double times_known(double factor, double known) { return std::isinf(known) ? known : factor * known; }

/// Bounds on sup |e|, m. Infinite if a required number is unknown.
struct DisturbanceBounds {
  double by_rate = std::numeric_limits<double>::infinity();       ///< B1 = |h|_1 sup|f'|
  double by_amplitude = std::numeric_limits<double>::infinity();  ///< B2 = |h'|_1 sup|f|
  double by_edges = std::numeric_limits<double>::infinity();      ///< B3 = |h|_oo TV(f)
  /// B4 = sum over the passes of impulse times sup |h'| over the times at which that pass still has an effect
  double by_impulse = std::numeric_limits<double>::infinity();
  /// B5: amplitude and rate together; at most min(B1, B2). See amplitude_and_rate_bound().
  double by_both = std::numeric_limits<double>::infinity();

  double least() const;
  /// Adds an error that acts in addition to the class to the bound of every class.
  void add(double error_m);
  /// "rate", "amplitude", "edges", "impulse" or "amplitude and rate"; "none" if nothing is known.
  std::string which() const;
};

/// Returns the bounds for a continuous loop. Earlier passes contribute what remains of their responses.
DisturbanceBounds disturbance_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance);

/// Combined gains of all passes, per unit of one pass; empty functions for an unstable loop.
struct FeltPasses {
  std::function<double()> impulses, edges;
};

/// Multiplies the gains by what is known of each class; shared by the continuous and the sampled loop.
DisturbanceBounds bounds_by_class(const GainNorms& gains, const Disturbance& disturbance, bool has_integrator,
                                  const FeltPasses& felt);

/// Returns the sum over the passes of gain_after(time since the pass ended): the combined gain of all passes, per unit
/// of one pass.
/// @param gain_after a decreasing function.
double felt_passes(const Disturbance& disturbance, const std::function<double(double)>& gain_after);

/// Effect of a clamp |int e| <= limit on the bounds of the linear loop.
struct ClampBounds {
  bool exists = false;  ///< true if there is a clamp, and an integrator that it could limit
  /// Bound on the integrator of the linear loop, m s: the gain from f to int e, plus integral_demand_m_s().
  double demand_m_s = 0;
  /// True if the demand is within the limit; the clamp then never acts, and the bounds of the linear loop hold.
  bool never_acts = true;
  /// Bounds that hold whether or not the clamp acts: the integral is a command of at most m Ki limit, which acts like f
  /// on the loop without integral. They are |h'_PD|_1 sup|f| + |c'_PD|_1 m Ki limit, c the command channel, and for
  /// impulses |h'_PD|_oo int|f| + |c'_PD|_1 m Ki limit, each plus error_parts() of the loop without integral.
  double by_amplitude = std::numeric_limits<double>::infinity();
  double by_impulse = std::numeric_limits<double>::infinity();

  void set_demand(double value_m_s, double limit_m_s) {
    demand_m_s = value_m_s;
    never_acts = value_m_s <= limit_m_s;
  }
};

/// Returns the demand on the integrator, and whether its clamp may act: clamp_bounds() without bounds.
ClampBounds clamp_demand(const AxisLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s);

/// Returns the clamp's effect. For a sampled loop's own clamp see sampled_bounds.h.
/// @param limit_m_s on |int e dt|, FlownLoop::integral_limit_m_s(); infinite: no clamp.
ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s);

/// Returns sup |u| of the commanded force due to a force error, N; for kCommand including the error itself.
double effort_of_class_N(const AxisLoop& loop, Channel channel, const Disturbance& disturbance);

/// clamp_bounds() of a continuous or sampled loop.
/// @param felt returns the impulse gain of all passes together of the loop without integral.
template <class AnyLoop, class Felt>
ClampBounds clamp_bounds_of(const AnyLoop& loop, Channel channel, const Disturbance& disturbance,
                            const OtherErrors& other, double limit_m_s, const Felt& felt) {
  ClampBounds result = clamp_demand(loop, channel, disturbance, other, limit_m_s);
  if (!result.exists) return result;
  AnyLoop without = loop;
  plant_of(without).Ki = 0;
  const GainNorms pd = norms_of(without, channel);
  const GainNorms command = channel == Channel::kCommand ? pd : norms_of(without, Channel::kCommand);
  const double integral_N = plant_of(loop).mass_kg * plant_of(loop).Ki * limit_m_s;
  const double constant_m = command.amplitude * integral_N + error_parts(without, pd.edge, other).total_m();
  result.by_amplitude = times_known(pd.amplitude, disturbance.amplitude_N) + constant_m;
  if (std::isfinite(disturbance.impulse_N_s) && std::isfinite(pd.impulse))
    result.by_impulse = disturbance.impulse_N_s * felt(without, pd) + constant_m;
  return result;
}

/// Returns a bound on sup |e| over all f with |f| <= amplitude and |f'| <= rate, from rest: split_bound() of h on a
/// grid of `nodes`.
double amplitude_and_rate_bound(const AxisLoop& loop, Channel channel, double amplitude_N, double rate_N_s,
                                int nodes = 6000);

/// Returns a bound on the tracking error due to the staircase f_hat. Updated every period and delayed by a latency, it
/// differs from its source by at most (period + latency) sup|f_hat'|. Splits f into the continuous part and the
/// staircase part, and bounds the latter by its amplitude.
/// @return m: |h'|_1 (1/rate_hz + latency_s) rate_of_f_hat_N_s
double staircase_error(const GainNorms& gains, double rate_hz, double latency_s, double rate_of_f_hat_N_s);

}  // namespace swarmcert::stability

#include "analysis/tracking/tube/hold_error.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::analysis {
void LoopHistory::add(const LoopHistory& later) {
  for (double LoopHistory::*const entry :
       {&LoopHistory::position_m, &LoopHistory::velocity_m_s, &LoopHistory::time_s}) {
    // Keeps NaN, since it means that no bound is known.
    if (!std::isnan(this->*entry) && !(later.*entry <= this->*entry)) this->*entry = later.*entry;
  }
}

HeldAnswer hold_error(const ErrorLoop& loop, const HeldSlice& slice) {
  const Interval unknown = whole_line();
  const HeldAnswer nothing{unknown, unknown, unknown, unknown.upper};
  const Interval T(loop.period_s);
  const Interval mass(loop.mass_kg);
  const Interval per_N = mass * slice.per_N;
  const Interval per_rising_N = mass * T * slice.per_rising_N;
  const Interval trapezoidal = Interval(loop.Ki) * T * T * slice.history.time_s / Interval(12);
  const Interval rest =
      T * Interval(loop.Ki) * (slice.history.position_m + T * slice.history.velocity_m_s) / Interval(2);
  const double near_m_s2 = std::max(slice.acceleration_m_s2.mag(), slice.acceleration_before_m_s2.mag());
  const double ever_m_s2 = std::max(near_m_s2, slice.largest_acceleration_m_s2);
  // `more`, the contribution of x to |e''| in the slice, satisfies
  //   more <= per_rising_N (Kp |e'| + sup|p_d'''| + Kd (near + more)) + per_N (rest + trapezoidal (ever + more)).
  const Interval left = Interval(1) - per_rising_N * loop.Kd - per_N * trapezoidal;
  if (!(left.lower > 0)) return nothing;
  const double more_m_s2 = ((per_rising_N * (Interval(loop.Kp) * slice.velocity_m_s.mag() +
                                             slice.jerk_m_s3.mag() + Interval(loop.Kd) * near_m_s2) +
                             per_N * (rest + trapezoidal * ever_m_s2)) /
                            Interval(left.lower))
                               .upper;
  HeldAnswer result;
  result.acceleration_m_s2 = slice.acceleration_m_s2 + Interval(-more_m_s2, more_m_s2);
  const Interval slope = Interval(loop.Kp) * slice.velocity_m_s +
                         Interval(loop.Kd) * hull(result.acceleration_m_s2, slice.acceleration_before_m_s2) -
                         slice.jerk_m_s3;
  const double largest_m_s2 = std::max(slice.largest_acceleration_m_s2, result.acceleration_m_s2.mag());
  const double away = (rest + trapezoidal * largest_m_s2).upper;
  result.hold_N = mass * (Interval(0, T.upper) * slope + Interval(-away, away));
  result.mean_N = result.hold_N;
  if (loop.has_whole_periods) {
    result.mean_N = mass * (T * slope / Interval(2) + Interval(-away, away));
    result.sawtooth_N_s = (mass * T * T * slope.mag() / Interval(8)).upper;
  }
  const bool is_known = std::isfinite(result.hold_N.lower) && std::isfinite(result.hold_N.upper);
  return is_known ? result : nothing;
}

double sum_excess_m_s(const ErrorLoop& loop, const LoopHistory& history, double acceleration_m_s2) {
  if (loop.period_s == 0) return 0;
  const Interval T(loop.period_s);
  return (T * history.position_m / Interval(2) + T * T * history.time_s * acceleration_m_s2 / Interval(12))
      .upper;
}

}  // namespace swarmcert::analysis

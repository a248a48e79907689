#include "analysis/tracking/tube/axis_in_slices.h"

#include <algorithm>

namespace swarmcert::analysis {

namespace {

using stability::KernelCells;

Interval last(const std::vector<Interval>& past) { return past.empty() ? Interval(0) : past.back(); }

}  // namespace

void AxisInSlices::begin_slice() {
  const std::size_t n = force.size();
  position_m = answer_to_past(*loop->h1, force, n);
  velocity_m_s = answer_to_past(*loop->h2, force, n);
  const double of_estimates_m = estimates->errors.position_m[n];
  const double of_estimates_m_s = estimates->errors.velocity_m_s[n];
  if (of_estimates_m > 0 || of_estimates_m_s > 0) {
    position_m += Interval(-of_estimates_m, of_estimates_m);
    velocity_m_s += Interval(-of_estimates_m_s, of_estimates_m_s);
  }
  if (loop->period_s > 0) {
    begin_acceleration(n);
    const double of_estimates_m_s2 = estimates->acceleration_m_s2[n];
    if (of_estimates_m_s2 > 0) acceleration_m_s2 += Interval(-of_estimates_m_s2, of_estimates_m_s2);
  }
  if (loop->has_whole_periods) {
    position_m += answer_to_past(*loop->slope1, sawtooth, n);
    velocity_m_s += answer_to_past(*loop->slope2, sawtooth, n);
  }
  if (!loop->has_lag) return;
  if (start != nullptr) {
    position_m += excess_N * start->position_m[n];
    velocity_m_s += excess_N * start->velocity_m_s[n];
  }
  position_m += answer_to_past(*loop->g1, lagging, n);
  velocity_m_s += answer_to_past(*loop->g2, lagging, n);
}

void AxisInSlices::begin_acceleration(std::size_t n) {
  if (!loop->has_lag) {
    acceleration_m_s2 = -answer_to_past(*loop->direct_rest, whole_force, n);
    return;
  }
  acceleration_m_s2 = answer_to_past(*loop->h3, force, n) - answer_to_past(*loop->direct_rest, lagging, n);
  if (loop->has_whole_periods) acceleration_m_s2 += answer_to_past(*loop->slope3, sawtooth, n);
  if (start != nullptr) acceleration_m_s2 += excess_N * start->acceleration_m_s2[n];
}

HeldAnswer AxisInSlices::held(Interval d, Interval w, Interval velocity, Interval jerk_m_s3,
                              const LoopHistory& history, std::size_t back) const {
  const std::size_t n = force.size();
  const auto with_last = [](Interval now, const std::vector<Interval>& past) {
    return hull(now, last(past));
  };
  const Interval direct = Interval(1) / loop->mass_kg;
  HeldSlice slice;
  slice.velocity_m_s = velocity;
  slice.history = history;
  slice.jerk_m_s3 = jerk_m_s3;
  const KernelCells& rest = *loop->direct_rest;
  if (loop->has_lag) {
    slice.acceleration_m_s2 = acceleration_m_s2 + stability::answer(*loop->h3, 0, with_last(d, force)) +
                              direct * w - stability::answer(rest, 0, with_last(w, lagging));
    slice.per_N = slice.per_rising_N = loop->h3->integral[0];
    if (loop->has_whole_periods) {
      slice.acceleration_m_s2 += stability::answer(*loop->slope3, 0, last(sawtooth));
      slice.per_rising_N = std::min(slice.per_N, up(up(loop->h3->integral[0] / 2) +
                                                    up(up(loop->period_s / 8) * loop->slope3->integral[0])));
    }
  } else {
    slice.acceleration_m_s2 =
        acceleration_m_s2 + direct * d - stability::answer(rest, 0, with_last(d, whole_force));
    slice.per_N = slice.per_rising_N = (direct + rest.integral[0]).upper;
  }
  slice.acceleration_before_m_s2 = slice.acceleration_m_s2;
  for (std::size_t k = n - std::min(back, n); k < n; ++k)
    slice.acceleration_before_m_s2 = hull(slice.acceleration_before_m_s2, acceleration[k]);
  for (const Interval& a : acceleration)
    slice.largest_acceleration_m_s2 = std::max(slice.largest_acceleration_m_s2, a.mag());
  return hold_error(*loop, slice);
}

void AxisInSlices::answer(Interval d, Interval w, double saw, Interval& position, Interval& velocity) const {
  const Interval both_d = hull(d, last(force));
  position = position_m + stability::answer(*loop->h1, 0, both_d);
  velocity = velocity_m_s + stability::answer(*loop->h2, 0, both_d);
  if (loop->has_whole_periods) {
    const Interval both_saw = hull(Interval(-saw, saw), last(sawtooth));
    position += stability::answer(*loop->slope1, 0, both_saw);
    velocity += stability::answer(*loop->slope2, 0, both_saw);
  }
  if (!loop->has_lag) return;
  const Interval both_w = hull(w, last(lagging));
  position += stability::answer(*loop->g1, 0, both_w);
  velocity += stability::answer(*loop->g2, 0, both_w);
}

}  // namespace swarmcert::analysis

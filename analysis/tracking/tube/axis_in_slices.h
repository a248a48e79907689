/// @file One axis of one vehicle on its way through the slices of a tube: its signals so far, and what they do to its
/// errors. Not for users; see sliced_tube.h.
#pragma once

#include <vector>

#include "analysis/tracking/tube/hold_error.h"

namespace swarmcert::analysis {

/// Signals of one vehicle and axis, and what all but the present slice do to the error.
struct AxisInSlices {
  const ErrorLoop* loop = nullptr;
  std::vector<Interval> force, lagging;  ///< d and w, slices so far; of m x the part HeldAnswer::mean_N
  std::vector<Interval> whole_force;     ///< d with all of m x
  std::vector<Interval> sawtooth;        ///< +- HeldAnswer::sawtooth_N_s
  std::vector<Interval> acceleration;    ///< e'', likewise
  LoopHistory met;                       ///< likewise
  const LagStart* start = nullptr;       ///< of the rotors; null: there is none
  Interval excess_N{0};                  ///< their thrust beyond the weight at the start
  const EstimateAnswer* estimates = nullptr;
  Interval position_m, velocity_m_s;  ///< from the slices before
  Interval acceleration_m_s2;         ///< likewise; where the loop is sampled

  /// Sets what the slices so far do to the next one.
  void begin_slice();

  /// m x and e'' of this slice if its signals without m x are d and w, e' is `velocity` since a period ago.
  /// @param back slices before this one in which a command that acts in this one may have been made.
  HeldAnswer held(Interval d, Interval w, Interval velocity, Interval jerk_m_s3, const LoopHistory& history,
                  std::size_t back) const;

  /// The errors of this slice if its signals are these. @param saw bounds the integral of the sawtooth in d, N s.
  void answer(Interval d, Interval w, double saw, Interval& position, Interval& velocity) const;

 private:
  void begin_acceleration(std::size_t n);
};

}  // namespace swarmcert::analysis

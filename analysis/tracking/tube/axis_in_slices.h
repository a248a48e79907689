/// @file One axis of one vehicle as it passes through the slices of a tube: its signals so far, and their effect on the
/// errors. Internal; see sliced_tube.h.
#pragma once

#include <vector>

#include "analysis/tracking/tube/hold_error.h"

namespace swarmcert::analysis {

/// Signals of one vehicle and axis, and the effect of all slices before the present one on the error.
struct AxisInSlices {
  const ErrorLoop* loop = nullptr;
  std::vector<Interval> force, lagging;  ///< d and w in the slices so far; of m x only HeldAnswer::mean_N
  std::vector<Interval> whole_force;     ///< d including all of m x
  std::vector<Interval> sawtooth;        ///< +- HeldAnswer::sawtooth_N_s
  std::vector<Interval> acceleration;    ///< e'', for the slices so far
  LoopHistory met;                       ///< for the slices so far
  const LagStart* start = nullptr;       ///< of the rotors; null: none
  Interval excess_N{0};                  ///< their thrust in excess of the weight at the start
  const EstimateAnswer* estimates = nullptr;
  Interval position_m, velocity_m_s;  ///< effect of the earlier slices
  Interval acceleration_m_s2;         ///< likewise; used if the loop is sampled

  /// Computes the effect of the slices so far on the next one.
  void begin_slice();

  /// Returns m x and e'' in this slice if its signals without m x are d and w, and e' lies in `velocity` since one
  /// period before it.
  /// @param back number of earlier slices in which a command acting in this slice may have been computed.
  HeldAnswer held(Interval d, Interval w, Interval velocity, Interval jerk_m_s3, const LoopHistory& history,
                  std::size_t back) const;

  /// Returns the errors in this slice for the given signals.
  /// @param saw bound on the integral of the sawtooth in d, N s.
  void answer(Interval d, Interval w, double saw, Interval& position, Interval& velocity) const;

 private:
  void begin_acceleration(std::size_t n);
};

}  // namespace swarmcert::analysis

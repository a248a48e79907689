/// @file Optimises the PID gains of one axis under constraints.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "stability/bounds/loops/attitude_cascade.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

struct TuneConstraints {
  double most_noise_m_s2 = 0;    ///< of the command, for 1 mm and 0.05 m/s of sensor noise
  double least_lag_limit_s = 0;  ///< additional first-order lag that the loop must tolerate
  /// m per N/s; 0: no such constraint. It enforces a minimum Ki, as the rate gain is at least 1/(m Ki).
  double most_rate = 0;
  double most_effort = 0;  ///< N/N; 0: no such constraint
};

/// The gain of the sampled loop that is minimised; null: the error under the declared disturbance.
using TuneObjective = double GainNorms::*;

/// What a declared disturbance does to the vehicle.
struct DisturbedLoop {
  double error_m = 0;          ///< upper bound on the axis
  double thrust_margin_N = 0;  ///< Saturation::margin_N()
};

struct TuneOptions {
  TuneObjective objective = &GainNorms::impulse;
  /// The vehicle with other gains on the axis, as written in firmware; empty: no disturbance is declared. Gains under
  /// which the thrust is not proved to suffice are then infeasible.
  std::function<DisturbedLoop(const SampledLoop&)> under_disturbance = {};
  TuneConstraints constraints;
  /// The attitude loop as flown, with the motor lag and the thrust ratio; its position gains are ignored. Gains that
  /// nearness_to_limit_cycle() classifies as close or unstable are then infeasible.
  std::optional<Cascade> attitude = {};
  double range = 8;  ///< searched range: the given gains divided and multiplied by this
  int global_evaluations = 4000;
  int local_evaluations = 600;
  std::uint64_t seed = 1;
  std::function<void(int done, int total)> progress = {};  ///< called after every evaluation
  const std::atomic<bool>* cancelled = nullptr;            ///< once set, the best gains so far are returned
};

struct TunedPoint {
  double Kp = 0, Kd = 0, Ki = 0;
  double objective = 0;
  GainNorms norms;  ///< force channel of the sampled loop, at and between its samples
  double noise_m_s2 = 0, lag_limit_s = 0, effort = 0;
  std::optional<CascadeMargins> margins;   ///< with TuneOptions::attitude
  std::optional<DisturbedLoop> disturbed;  ///< with TuneOptions::under_disturbance
  bool feasible = false;
  double excess = 0;  ///< relative violation of the worst constraint; at most 0 if feasible
};

struct TuneResult {
  TunedPoint shipped;
  TunedPoint best;                    ///< the least infeasible point if none is feasible
  std::vector<std::string> violated;  ///< constraints violated by `best`, if it is infeasible
  /// Why no gains in the range satisfy the constraints, if that is proved; else empty.
  std::string infeasible;
  /// Constraints within 0.1 % of their limit at the best gains, and gains at the ends of their range.
  std::vector<std::string> active_constraints;
  std::string stopped;  ///< why the search ended; it does not prove that the gains found are optimal
};

/// Evaluates objective and constraints for one set of gains, given as in the firmware.
TunedPoint evaluate_gains(const SampledLoop& loop, const TuneOptions& options);

/// Returns the margins of these gains around the attitude loop.
/// @param loop its gains divided by `attitude.ratio` are the firmware gains.
CascadeMargins margins_of(const SampledLoop& loop, const Cascade& attitude);

/// Improves Kp, Kd and Ki of `loop` (only Kp and Kd if its Ki is 0, which then stays 0): a derivative-free global
/// search (GN_ISRES, seeded) over the logarithms of the gains, then COBYLA from its best point and from the given
/// gains. The objective is that of the sampled loop; it has no derivative because of its kinks (sign changes of the
/// kernel). The result is never worse than the given gains if those are feasible.
TuneResult tune(const SampledLoop& loop, const TuneOptions& options);

}  // namespace swarmcert::stability

/// @file The best PID gains of one axis under constraints.
#pragma once

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
  double least_lag_limit_s = 0;  ///< further first-order lag that the loop must bear
  double most_rate =
      0;  ///< m per N/s; 0: no such constraint. As the rate gain is at least 1/(m Ki), it keeps Ki up
  double most_effort = 0;  ///< N/N; 0: no such constraint
};

enum class TuneObjective { kAmplitude, kImpulse, kEdge, kRate };

struct TuneOptions {
  TuneObjective objective = TuneObjective::kImpulse;
  TuneConstraints constraints;
  /// The attitude loop that flies, with the motors' lag and the thrust's ratio; its position gains are not read. Gains
  /// that nearness_to_limit_cycle() calls close or unstable are then not feasible.
  std::optional<Cascade> attitude = {};
  double range = 8;  ///< gains between the given ones divided and multiplied by this
  int global_evaluations = 4000;
  int local_evaluations = 600;
  std::uint64_t seed = 1;
  std::function<void(int done, int total)> progress = {};  ///< called after every evaluation
};

struct TunedPoint {
  double Kp = 0, Kd = 0, Ki = 0;
  double objective = 0;
  GainNorms norms;
  double noise_m_s2 = 0, lag_limit_s = 0, effort = 0;
  std::optional<CascadeMargins> margins;  ///< with TuneOptions::attitude
  bool feasible = false;
  double excess = 0;  ///< of the constraint that is violated most, relative; at most 0 where feasible
};

struct TuneResult {
  TunedPoint shipped;
  TunedPoint best;                          ///< where none is feasible: the one that violates least
  GainNorms shipped_sampled, best_sampled;  ///< force channel of the sampled loop, at its samples
  std::vector<std::string> violated;        ///< by `best`, where it is not feasible
  /// Why no gains of the range satisfy the constraints, where that is proved; else empty.
  std::string infeasible;
  /// Constraints within 0.1 % of their limit at the best gains, and gains at the end of their range.
  std::vector<std::string> active_constraints;
  std::string stopped;  ///< why the search ended; it finds good gains, it does not prove them best
};

/// Everything that constraints and objectives look at, for one set of gains as firmware writes them.
TunedPoint evaluate_gains(const SampledLoop& loop, TuneObjective objective);

/// The margins of these gains around the attitude loop. @param loop gains divided by `attitude.ratio` are those of
/// firmware.
CascadeMargins margins_of(const SampledLoop& loop, const Cascade& attitude);

/// Improves Kp, Kd, Ki of `loop`, and Kp and Kd alone where its Ki is 0, which it then stays: a global search without
/// derivatives (GN_ISRES, seeded) over the logarithms of the gains, then COBYLA from its best point and from the given
/// gains. The objective is that of the continuous loop with the effective Ki, as its kinks (sign changes of the kernel)
/// leave it no derivative. The result is never worse than the given gains where those are feasible.
TuneResult tune(const SampledLoop& loop, const TuneOptions& options);

/// "amplitude", "impulse", "edge", "rate".
const char* name(TuneObjective objective);

}  // namespace swarmcert::stability

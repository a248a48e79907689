/// @file What `bound` computes on request: intervals of the vehicle, rigorous enclosures, the tube over time, a swarm.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"

namespace swarmcert::analysis {

/// Parameters of the computation of --uncertain.
struct UncertainRun {
  int jobs = 0;
  int most_loops = 6000;  ///< per axis, channel and loop
  std::function<void(int done, int total)> progress;
  const std::atomic<bool>* cancelled = nullptr;  ///< if set, bounds are returned as far as computed
};

/// --uncertain: encloses the suprema of the gains over parameter intervals, per axis, channel and loop, with the
/// points at which they are attained. Each search ends when upper and lower bound are within 2 %, when the budget is
/// spent, or when it is cancelled; the rows say which.
/// @param words "mass=0.032:0.037" and so on: mass (kg), thrust (ratio), lag (s), delay (s), battery (V). Parameters
///     that are not named vary by 5 % (mass), 10 % (thrust), 20 % (lag, delay) about the model and the gains.
/// @throws UsageError for words that cannot be parsed.
files::Json uncertain_json(const Tracking& input, const std::vector<std::string>& words,
                           const UncertainRun& run);
void print_uncertain(const files::Json& uncertain);

/// --verified: encloses the gains per axis, channel and loop. A loop that could not be proved stable has no
/// enclosure, and its row says so.
files::Json verified_json(const Tracking& input);
void print_verified(const files::Json& verified);

/// --tube: bounds |e(t)| from rest in the force channel, per axis, at `count` times.
files::Json tube_json(const Tracking& input, const stability::DisturbanceSource& source, int count);

/// --swarm FILE (schema swarmcert/swarm/1): vehicles = N, [[coupling]] on, by, position_N_m, velocity_N_s_m,
/// speed_m_s, acceleration_m_s2, cross_rate_N_s, direction = "apart" | "together" if the sign of the force is known.
/// Every vehicle has the given gains and model; its z loop is analysed. The verdict is refuted if the forces as
/// stated, with their directions, make errors grow in a simulation. The bounds contain the estimation errors that
/// `source` states.
/// @throws UsageError if neither the size nor the rate of the force error or of the estimation errors is known.
files::Json swarm_json(const Tracking& input, const std::string& path,
                       const stability::DisturbanceSource& source);
void print_swarm(const files::Json& swarm);

}  // namespace swarmcert::analysis

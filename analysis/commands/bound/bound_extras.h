/// @file What `bound` computes on request: intervals of the vehicle, rigorous enclosures, the tube over time, a swarm.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"

namespace swarmcert::analysis {

/// How --uncertain is computed.
struct UncertainRun {
  int jobs = 0;
  int most_loops = 6000;  ///< per axis, channel and loop
  std::function<void(int done, int total)> progress;
  const std::atomic<bool>* cancelled = nullptr;  ///< set: bounds as far as they are
};

/// --uncertain: suprema of the gains over intervals, enclosed, per axis, channel and loop, and where they are reached.
/// Each until upper and lower are 2 % apart, the budget is spent, or cancelled; rows say which.
/// @param words "mass=0.032:0.037" and the like: mass (kg), thrust (ratio), lag (s), delay (s), battery (V). What is
///   not named varies by 5 % (mass), 10 % (thrust), 20 % (lag, delay) about the model and the gains.
/// @throws UsageError for words that are not understood.
files::Json uncertain_json(const Tracking& input, const std::vector<std::string>& words,
                           const UncertainRun& run);
void print_uncertain(const files::Json& uncertain);

/// --verified: enclosures of the gains, per axis, channel and loop; a loop that could not be proved stable has none and
/// says so.
files::Json verified_json(const Tracking& input);
void print_verified(const files::Json& verified);

/// --tube: bound of |e(t)| from rest, force channel, per axis, at `count` times.
files::Json tube_json(const Tracking& input, const stability::DisturbanceSource& source, int count);

/// --swarm FILE (schema swarmcert/swarm/1): vehicles = N, [[coupling]] on, by, position_N_m, velocity_N_s_m, speed_m_s,
/// acceleration_m_s2, cross_rate_N_s, direction = "apart" | "together" where the force's sign is known; every vehicle
/// has the gains and the model given, its z loop is studied. Refuted: the forces as stated, with their directions, make
/// errors grow in a simulation. The errors of the estimates that `source` states are in the bounds.
/// @throws UsageError where they are known neither by their size nor by their rate.
files::Json swarm_json(const Tracking& input, const std::string& path,
                       const stability::DisturbanceSource& source);
void print_swarm(const files::Json& swarm);

}  // namespace swarmcert::analysis

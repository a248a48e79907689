/// @file `bound --uncertain`: the worst gains over intervals of the vehicle.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/bounds/uncertain/uncertain_norms.h"

namespace swarmcert::analysis {

/// Parameters of the computation.
struct UncertainRun {
  int jobs = 0;
  int most_loops = 6000;  ///< per axis, channel and loop
  std::function<void(int done, int total)> progress;
  const std::atomic<bool>* cancelled = nullptr;  ///< if set, bounds are returned as far as computed
};

/// The suprema of the gains of one loop over the intervals.
struct UncertainRow {
  int axis = 0;
  stability::Channel channel = stability::Channel::kForce;
  stability::Loop loop = stability::Loop::kContinuous;
  stability::UncertainNorms norms;
};

struct Uncertain {
  stability::UncertainPlant plant;
  std::vector<UncertainRow> gains;
};
void describe(files::Record& record, const Uncertain& uncertain);

/// Encloses the suprema of the gains over parameter intervals, per axis, channel and loop, with the points at which
/// they are attained. Each search ends when upper and lower bound are within 2 %, when the budget is spent, or when it
/// is cancelled; the rows say which.
/// @param words "mass=0.032:0.037" and so on: mass (kg), thrust (ratio), lag (s), delay (s), battery (V). Parameters
///     that are not named vary by 5 % (mass), 10 % (thrust), 20 % (lag, delay) about the model and the gains.
/// @throws UsageError for words that cannot be parsed.
Uncertain uncertain_gains(const Tracking& input, const std::vector<std::string>& words,
                          const UncertainRun& run);
void print(const Uncertain& uncertain);

}  // namespace swarmcert::analysis

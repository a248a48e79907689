/// @file Split-conformal prediction over groups of flights: a promise for a flight that was not seen.
///
/// A score says how far a flight exceeded a prediction made without it, e.g. measured peak over predicted peak. If the
/// groups of flights (gain sets, vehicles, days) are exchangeable with that of a further flight, then this flight's
/// score stays below the threshold with at least the stated probability, whatever the distribution of scores
/// (Vovk et al. 2005; with groups: Dunn, Wasserman, Ramdas, J. Am. Stat. Assoc. 2022). Flights of one group may depend
/// on each other; they share the weight of one. It is a statement on the average over calibrations: given the one at
/// hand, the probability itself is random, with the Beta distribution of `coverage_90`.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::analysis {

struct FlightScore {
  std::string group;
  double value = 0;
};

struct ConformalThreshold {
  double level = 0;      ///< probability that was asked for
  double threshold = 0;  ///< a further flight's score is at most this
  int groups = 0;        ///< on which it rests
  int flights = 0;
  /// What the probability is for the calibration at hand: 5 % and 95 % quantiles of Beta(k, groups + 1 - k), with
  /// k = ceil(level (groups + 1)) the rank of the threshold.
  Interval coverage_90;
};

/// Groups that a level needs at least: level / (1 - level), rounded up. With fewer no finite threshold holds.
int fewest_groups(double level);

/// The smallest score at and below which the groups have a weight of level (groups + 1), a group's weight being one.
/// @param level in (0, 1).
/// @throws std::invalid_argument for a level outside, or fewer than fewest_groups(level): ask first.
ConformalThreshold conformal_threshold(const std::vector<FlightScore>& scores, double level);

/// Quantiles of the Beta distribution with whole parameters, by bisection of its binomial sum.
double beta_quantile(int a, int b, double probability);

}  // namespace swarmcert::analysis

/// @file Split-conformal prediction over groups of flights: a promise for an unseen flight.
///
/// A score states how far a flight exceeded a prediction made without it, e.g. measured peak over predicted peak. If
/// the groups of flights (gain sets, vehicles, days) are exchangeable with the group of a further flight, then the
/// score of this flight stays below the threshold with at least the stated probability, whatever the distribution of
/// scores (Vovk et al. 2005; with groups: Dunn, Wasserman, Ramdas, J. Am. Stat. Assoc. 2022). Flights within a group
/// may depend on each other; together they have the weight of one. The statement holds on average over calibrations:
/// given the calibration at hand, the coverage probability is itself random, with the Beta distribution of
/// `coverage_90`.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::analysis {

struct FlightScore {
  std::string group;
  double value = 0;
};

struct ConformalThreshold {
  double level = 0;      ///< requested probability
  double threshold = 0;  ///< upper bound on the score of a further flight
  int groups = 0;        ///< number of groups used
  int flights = 0;
  /// Coverage probability of the calibration at hand: 5 % and 95 % quantiles of Beta(k, groups + 1 - k), where k =
  /// ceil(level (groups + 1)) is the rank of the threshold.
  Interval coverage_90;
};

/// Returns the weight of each flight: one over the number of flights in its group.
template <class Flight>
std::vector<double> group_weights(const std::vector<Flight>& flights) {
  std::map<std::string, int> count;
  for (const Flight& flight : flights) ++count[flight.group];
  std::vector<double> weights;
  for (const Flight& flight : flights) weights.push_back(1.0 / count[flight.group]);
  return weights;
}

/// Returns the least number of groups for a level: level / (1 - level), rounded up. With fewer groups no finite
/// threshold holds.
int fewest_groups(double level);

/// Returns the smallest score such that the scores up to it have a weight of at least level (groups + 1), where each
/// group has weight one.
/// @param level in (0, 1).
/// @throws std::invalid_argument for a level outside this range, or for fewer than fewest_groups(level) groups.
ConformalThreshold conformal_threshold(const std::vector<FlightScore>& scores, double level);

/// Quantile of the Beta distribution with integer parameters, by bisection of the binomial sum.
double beta_quantile(int a, int b, double probability);

}  // namespace swarmcert::analysis

/// @file Tests whether the disturbances between vehicles show how a clock is related to others.
///
/// Some offset always explains most, even if the true one lies outside of the search. Therefore the best offset is
/// compared with its rivals at all offsets at which the logs overlap: if the clock is unrelated, the best one is as
/// likely to lie anywhere, and exceeds the next one only by chance.
#pragma once

#include <vector>

#include "analysis/identification/clocks/clock_interplay.h"

namespace swarmcert::identification {

/// A vehicle on a clock whose offset is given or sought.
struct ClockedVehicle {
  const residuals::Track* track = nullptr;
  const std::vector<Eigen::Vector3d>* r = nullptr;  ///< force_residual() of `track`, in W
  int clock = 0;
  double ahead_s = 0;  ///< assumed offset of its clock, in addition to what is already known of it
};

/// The offset of a clock that explains most, among all at which its logs overlap the others by half.
struct ClockPeak {
  double ahead_s = 0;
  /// Probability that the best offset of an unrelated clock stands out as much; 1 if the logs are too short to tell.
  double chance = 1;
};

/// Returns the peak, over the offset o of `clock`, of the log likelihood ratio of the maps from the positions of the
/// other vehicles to the vertical force on each vehicle, -n/2 ln(1 - R^2) summed over all vehicles. The delay of a wake
/// from or to the vehicles of `clock` is fitted for each o on a lattice of 40 ms; between the others it is `delay_s`.
ClockPeak clock_peak(const std::vector<ClockedVehicle>& vehicles, int clock, double delay_s);

/// Returns exp(-gap / scale) for the gap between the largest of `values` and its largest rival: the probability of such
/// a gap if the values have an exponential tail with this scale. Rivals are the maxima over stretches as long as the
/// peak is wide, outside of the peak. Values that are not finite are left out.
/// @param values    likelihood ratios at equidistant offsets
/// @param narrowest least length of a stretch
/// @return 1 if there are fewer than 12 rivals
double chance_of_peak(const std::vector<double>& values, std::size_t narrowest);

}  // namespace swarmcert::identification

/// @file Offsets of the clocks of two logs of one flight, from how their vehicles disturb each other.
///
/// Let the second log's clock be ahead by o, and let what one vehicle does reach the other tau later. Then the force on
/// the first vehicle goes with where the second log has its vehicle at the same reading plus o - tau, and the force on
/// the second with where the first log has its vehicle at the same reading minus o + tau. A map from the neighbour's
/// place to the vertical force is fitted to each of both for every shift; (o, tau) explain most together. A delay alone
/// shifts both to the same side, so that it is not taken for a clock.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/findings.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

struct ClockOffset {
  std::string flight, vehicle, kind, path;  ///< of the second log
  double offset_s = 0;                      ///< o: by how much its clock is ahead
  Interval interval;                        ///< 90 %, from the jackknife over tenths of the flight
  double delay_s = 0;                       ///< tau, on the grid of the search
  double rmse_before_N = 0,
         rmse_after_N = 0;  ///< of both vertical forces, with a map of their own for each o
  int records = 0;          ///< means over kClockSample_s
  double z = 0;             ///< offset over its standard deviation
};

inline constexpr double kClockSample_s = 0.05;
inline constexpr double kLargestClockOffset_s = 0.4, kLongestWakeDelay_s = 0.3;

/// Of flights of two vehicles whose clocks nothing else relates: no absolute times, no common starts of their set
/// points. Empty where the vehicles hardly disturb each other, only one of them feels the other, or the offset is
/// within three standard deviations of zero.
std::vector<ClockOffset> clock_offsets(const residuals::Inputs& inputs, int jobs);

/// Lets the logs of `inputs` be read with these offsets.
void correct_clocks(const std::vector<ClockOffset>& offsets, residuals::Inputs& inputs);

/// "the clock of cf2_00 is 0.150 s ahead of that of the other log (+0.141 .. +0.158)".
std::string in_words(const ClockOffset& offset);

}  // namespace swarmcert::identification

/// @file Offsets of the clocks of the logs of one flight, from how their vehicles disturb each other.
///
/// A map from the neighbours' places to the vertical force is fitted to each vehicle, for clocks that differ and wakes
/// that arrive late (`clock_search.h`). A delay shifts all vehicles to the same side, so that it is not taken for a
/// clock; a clock shifts what its vehicle feels and what it does to others to opposite sides. So a clock is judged only
/// among vehicles each of which feels another one and is felt, around a circle.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/findings.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

struct ClockOffset {
  std::string flight, vehicle, kind, path;
  std::string against, against_vehicle;  ///< log and vehicle of the clock that it is compared with
  int logs = 2;                          ///< of the flight whose clocks were judged
  double offset_s = 0;                   ///< by how much its clock is ahead
  double correction_s = 0;               ///< offset_s and what is known of the clock already
  Interval interval;                     ///< 90 %, from the jackknife over tenths of the flight
  double delay_s = 0;                    ///< tau, on the grid of the search
  /// Of all vertical forces, with the two clocks alike and as they are; maps of their own.
  double rmse_before_N = 0, rmse_after_N = 0;
  int records = 0;  ///< means over kClockSample_s
  double z = 0;     ///< offset over its standard deviation
};

/// Of flights of two and more vehicles some of whose clocks nothing else relates: no absolute times, no common starts
/// of their set points. All clocks of a flight are estimated together, and compared with the one that most logs share,
/// else with that in the middle, else with the next of which another one surely differs. Empty where the vehicles
/// hardly disturb each other, one of them feels no other one or none feels it, or no two clocks differ by more than
/// three standard deviations and by what matters to how the vehicles disturb each other.
std::vector<ClockOffset> clock_offsets(const residuals::Inputs& inputs, int jobs);

/// Lets the logs of `inputs` be read with these offsets.
void correct_clocks(const std::vector<ClockOffset>& offsets, residuals::Inputs& inputs);

/// Finds offsets of clocks, and lets the logs of `inputs` be read with them.
std::vector<ClockOffset> find_and_correct_clocks(residuals::Inputs& inputs, int jobs);

/// "the clock of cf2_00 is 0.150 s ahead of that of the other log (+0.141 .. +0.158)"; of three logs and more, the log
/// with the other clock is named.
std::string in_words(const ClockOffset& offset);

}  // namespace swarmcert::identification

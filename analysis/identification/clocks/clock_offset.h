/// @file Clock offsets between the logs of a flight, estimated from the mutual disturbances of the vehicles.
///
/// A map from the neighbours' relative positions to the vertical force is fitted to each vehicle, for different clock
/// offsets and delays of the wakes (`clock_search.h`). A delay shifts all vehicles in the same direction, so it is not
/// mistaken for a clock offset; a clock offset shifts the disturbances on its vehicle and those caused by it in
/// opposite directions. Therefore a clock is judged only among vehicles that form a cycle in which each is disturbed by
/// another one.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/findings.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

struct ClockOffset {
  std::string flight, vehicle, kind, path;
  std::string against, against_vehicle;  ///< log and vehicle of the reference clock
  int logs = 2;                          ///< number of logs of the flight whose clocks were judged
  double offset_s = 0;                   ///< how far its clock is ahead
  double correction_s = 0;               ///< offset_s plus what is already known of the clock
  Interval interval;                     ///< 90 %, from the jackknife over tenths of the flight
  double delay_s = 0;                    ///< tau, on the grid of the search
  /// RMSE over all vertical forces, with equal clocks and with the estimated ones, each with its own maps.
  double rmse_before_N = 0, rmse_after_N = 0;
  int records = 0;  ///< means over kClockSample_s
  double z = 0;     ///< offset divided by its standard deviation
};

/// Estimates offsets for flights of two or more vehicles whose clocks are not all related by absolute times or common
/// starts of their setpoints. All clocks of a flight are estimated together and compared with the clock that most logs
/// share, else with the middle one, else with the next one from which another significantly differs. Returns nothing
/// for a flight if the vehicles hardly disturb each other, if one of them feels no other one or is felt by none, if
/// no two clocks differ by more than three standard deviations and by enough to matter for the disturbances, or if the
/// offset does not stand out from those at which the disturbances fit by chance (`clock_relation.h`). Clocks may differ
/// by as much as leaves half of the logs in common; beyond kSearched_s they are placed first (`clock_placement.h`).
std::vector<ClockOffset> clock_offsets(const residuals::Inputs& inputs, int jobs);

/// Makes `inputs` read its logs with these offsets.
void correct_clocks(const std::vector<ClockOffset>& offsets, residuals::Inputs& inputs);

/// Estimates clock offsets and makes `inputs` read its logs with them.
std::vector<ClockOffset> find_and_correct_clocks(residuals::Inputs& inputs, int jobs);

/// Describes the offset: "the clock of cf2_00 is 0.150 s ahead of that of the other log (+0.141 .. +0.158)"; with three
/// or more logs, the log with the other clock is named.
std::string in_words(const ClockOffset& offset);

}  // namespace swarmcert::identification

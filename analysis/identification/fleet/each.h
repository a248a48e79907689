/// @file The same few numbers of every flight: which differ from the others, and which drift.
///
/// What all flights of a kind have in common is held; thrust ratio, linear drag and motor lag are then fitted to each
/// flight of each vehicle alone, and the factors of its rotors to its slow flight (rotors/rotor_fit.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"

namespace swarmcert::identification {

/// A number of one flight with its 90 % interval; not observable where the flight does not show it.
struct FlightNumber {
  bool is_observable = false;
  double value = 0;
  Interval interval;
  bool is_outlier = false;  ///< among the flights of its vehicle, see each_flight()
};

/// The numbers by name: `thrust_ratio` as a factor, 1 is nominal; `drag_N_s_m`; `lag_s`; `rotor_1` .. `rotor_4`,
/// factors of each rotor beside the thrust ratio that they share. Whole values, not changes of the model's.
using FlightNumbers = std::map<std::string, FlightNumber>;

/// One vehicle in one flight.
struct EachFlight {
  std::string flight, day, vehicle, kind;
  std::size_t blocks = 0;
  std::string too_poor;  ///< why there are no numbers; empty if there are
  FlightNumbers numbers;
};

/// A day of one vehicle: means of its flights, weighted by their errors, with the scatter between them.
struct EachDay {
  std::string day, vehicle, kind;
  int flights = 0;
  FlightNumbers numbers;
};

/// A number's change from one flight of a vehicle to the next, in the order of the flights' names.
struct Drift {
  std::string number, vehicle, kind;
  double per_flight = 0;
  Interval interval;  ///< 90 %
  int flights = 0;
  bool is_there = false;  ///< the 99 % interval is without zero: some twenty numbers are looked at
};

struct Each {
  std::vector<EachFlight> flights;
  std::vector<EachDay> days;
  std::vector<Drift> drifts;
  std::vector<stability::EffectSpec> held;  ///< of the model, and what all flights have in common besides
};

/// Numbers in the order in which tables show them.
const std::vector<std::string>& each_numbers();

/// Every flight of every vehicle of `kind`. An outlier is a number further from the median of its vehicle's flights
/// (five or more) than 3.5 of their standard deviations, estimated by the median absolute deviation, together with the
/// number's own error. The result does not depend on `jobs`.
/// @param common what diagnose() found on all of them
Each each_flight(const residuals::Inputs& inputs, const std::string& kind,
                 const std::vector<stability::EffectSpec>& common, int jobs,
                 const residuals::Progress& progress);

}  // namespace swarmcert::identification

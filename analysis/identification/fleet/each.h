/// @file A few values per flight, to find outliers and drifts.
///
/// Effects common to all flights of a kind are held fixed; thrust ratio, linear drag and motor lag are then fitted to
/// each flight of each vehicle alone, and the rotor factors to its slow flight (rotors/rotor_fit.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"

namespace swarmcert::identification {

/// A value of one flight with its 90 % interval; not observable if the flight carries no information on it.
struct FlightNumber {
  bool is_observable = false;
  double value = 0;
  Interval interval;
  bool is_outlier = false;  ///< among the flights of its vehicle, see each_flight()
};

/// The values by name: `thrust_ratio` as a factor, 1 is nominal; `drag_N_s_m`; `lag_s`; `rotor_1` .. `rotor_4`, factors
/// of the rotors relative to their common thrust ratio. They are absolute values, not changes of the model's values.
using FlightNumbers = std::map<std::string, FlightNumber>;

/// One vehicle in one flight.
struct EachFlight {
  std::string flight, day, vehicle, kind;
  std::size_t blocks = 0;
  std::string too_poor;  ///< why there are no values; empty if there are
  FlightNumbers numbers;
};

/// A day of one vehicle: means over its flights, weighted by their errors, with the scatter between them.
struct EachDay {
  std::string day, vehicle, kind;
  int flights = 0;
  FlightNumbers numbers;
};

/// Change of a value from one flight of a vehicle to the next, ordered by name.
struct Drift {
  std::string number, vehicle, kind;
  double per_flight = 0;
  Interval interval;  ///< 90 %
  int flights = 0;
  bool is_there = false;  ///< the 99 % interval excludes zero (99 % because about twenty values are tested)
};

struct Each {
  std::vector<EachFlight> flights;
  std::vector<EachDay> days;
  std::vector<Drift> drifts;
  std::vector<stability::EffectSpec> held;  ///< effects of the model, and those common to all flights
};

/// Returns the names of the values in the order of tables.
std::vector<std::string> each_numbers();

/// Evaluates each flight of each vehicle of `kind`. A value is an outlier if it differs from the median of its
/// vehicle's flights (five or more) by more than 3.5 standard deviations, which combine the scatter, estimated by the
/// median absolute deviation, with the value's own error. The result does not depend on `jobs`.
/// @param common result of diagnose() for all of them
Each each_flight(const residuals::Inputs& inputs, const std::string& kind,
                 const std::vector<stability::EffectSpec>& common, int jobs,
                 const residuals::Progress& progress);

}  // namespace swarmcert::identification

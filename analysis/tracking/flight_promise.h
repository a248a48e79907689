/// @file A bound for a further flight. Each compared flight gives the class of its own force error, each class gives a
/// bound of the loop at hand, and these bounds give the conformal threshold.
///
/// The gains of the flights may differ from those of the loop: the force error is what transfers. If a further flight
/// is exchangeable with the compared ones and the loop is linear with the stated lags, the error of that flight stays
/// below the threshold with at least the requested probability: its bound is one more draw from the same distribution,
/// and its error is at most its bound.
#pragma once

#include <string>
#include <vector>

#include "analysis/tracking/conformal.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

/// The force error of one vehicle in one flight.
struct FlightClass {
  std::string flight, vehicle;
  stability::DisturbanceSource source;
};

/// Reads flights[].learning_error of a result of compare: the largest values over consecutive windows. Vehicles
/// without it are left out; axes along which no force was judged have infinite classes.
/// @throws files::InputError if the file is not such a result.
std::vector<FlightClass> read_flight_classes(const std::string& path);

/// One row of TrackingReport::bounds.
struct PromisedBound {
  int axis = 0;
  stability::Channel channel = stability::Channel::kForce;
  stability::Loop loop = stability::Loop::kContinuous;
  ConformalThreshold promise;  ///< the threshold is the bound in m
};

/// @param declared bias and estimation errors that act in addition to the classes.
/// @param report result of tracking_bounds(): its gains are reused, and staircase_m and float32_m of its bounds are
///     added.
/// @throws std::invalid_argument for fewer flights than the level needs; see fewest_groups().
std::vector<PromisedBound> promised_bounds(const stability::FlownLoop& loop,
                                           const stability::TrackingReport& report,
                                           const std::vector<FlightClass>& flights,
                                           const stability::DisturbanceSource& declared,
                                           const stability::InitialError& initial, double level);

}  // namespace swarmcert::analysis

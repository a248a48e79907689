/// @file A bound for a further flight: each flight that was compared gives the class of its own force error, each class
/// a bound of the loop at hand, and these bounds the conformal threshold.
///
/// The gains of the flights need not be those of the loop: what transfers is the force error. If a further flight is
/// exchangeable with those compared and the loop is linear with the lags stated, the error of that flight stays below
/// the threshold with at least the probability asked for: its bound is one more draw of the same distribution, and its
/// error is at most its bound.
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

/// flights[].learning_error of a result of compare, largest values over windows that follow one another. Vehicles
/// without one are left out; axes along which no force was judged have infinite classes.
/// @throws files::InputError where the file is no such result.
std::vector<FlightClass> read_flight_classes(const std::string& path);

/// One row of TrackingReport::bounds.
struct PromisedBound {
  int axis = 0;
  stability::Channel channel = stability::Channel::kForce;
  stability::Loop loop = stability::Loop::kContinuous;
  ConformalThreshold promise;  ///< its threshold is the bound, m
};

/// @param declared bias and errors of the estimates that act beside the classes. @param report of tracking_bounds():
///   its gains are taken up again, and staircase_m and float32_m of its bounds are added.
/// @throws std::invalid_argument for fewer flights than the level needs: see fewest_groups().
std::vector<PromisedBound> promised_bounds(const stability::Gains& gains, const stability::Plant& plant,
                                           const stability::TrackingReport& report,
                                           const std::vector<FlightClass>& flights,
                                           const stability::DisturbanceSource& declared,
                                           const stability::InitialError& initial, double level);

}  // namespace swarmcert::analysis

/// @file The parts of the tracking bound of a flight, computed only from its gains and its setpoint.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/reproduction/gain_flights.h"
#include "stability/bounds/loops/attitude_cascade.h"

namespace swarmcert::reproduction {

/// Flights that are judged together: along the setpoint's motion, across it, or vertically.
enum class Track { kAlong, kAcross, kVertical };
const char* track_name(Track track);
Track track_of(const GainFlight& flight, std::size_t axis);

/// Returns the gains that act on an axis as text; equal for equal gains.
std::string gain_set(const GainFlight& flight, std::size_t axis);
/// Returns vehicle and setpoint without the gains as text: the motors, and range and speed of the setpoint to 0.1 m
/// and 0.1 m/s.
std::string set_point_class(const GainFlight& flight, std::size_t axis);

/// Known parameters of the vehicle other than the gains.
struct CascadePlant {
  std::array<double, 3> inertia_kg_m2{};
  double lag_s = 0;  ///< motor lag
};

/// Returns the loop of one axis.
/// @param ratio actual force over commanded force.
stability::Cascade flown_cascade(const GainFlight& flight, std::size_t axis, const CascadePlant& plant,
                                 double ratio);

/// Names and units of the entries of FlightParts::of().
const std::vector<std::string>& part_names();
const std::vector<std::string>& part_units();

/// Computes the parts, and caches them by gains and by flight.
class FlightParts {
 public:
  explicit FlightParts(CascadePlant plant) : plant_(plant) {}

  /// Returns the parts in m per unit. The first three groups are for the force error, the error of the estimated
  /// velocity and the angular acceleration: the amplitude gain |h'|_1 and the edge gain sup |h|. They are followed by
  /// the largest error if force and velocity error are proportional to the setpoint's velocity. Infinite if the loop
  /// is unstable; zero if the axis has no such disturbance.
  /// @param ratio is rounded to 0.01.
  const std::vector<double>& of(const GainFlight& flight, std::size_t axis, double ratio);

 private:
  const std::vector<double>& norms(const GainFlight& flight, std::size_t axis, double ratio);

  CascadePlant plant_;
  std::map<std::string, std::vector<double>> norms_, parts_;
};

/// The steady height error of a hovering vehicle without an integrator: |g - thrust per mass|/Kp; zero with an
/// integrator, and along horizontal axes.
double steady_error_m(const GainFlight& flight, std::size_t axis, double ratio);

}  // namespace swarmcert::reproduction

/// @file The parts of the tracking bound of a flight, from its gains and its set point alone.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/reproduction/gain_flights.h"
#include "stability/bounds/loops/attitude_cascade.h"

namespace swarmcert::reproduction {

/// Which flights are judged together: along the set point's motion, across it, or vertically.
enum class Track { kAlong, kAcross, kVertical };
const char* track_name(Track track);
Track track_of(const GainFlight& flight, std::size_t axis);

/// The gains that act on an axis, as text: equal for equal gains.
std::string gain_set(const GainFlight& flight, std::size_t axis);
/// Vehicle and set point without the gains, as text: the motors, and range and speed of the set point to 0.1 m, 0.1
/// m/s.
std::string set_point_class(const GainFlight& flight, std::size_t axis);

/// What is known of the vehicle beside the gains.
struct CascadePlant {
  std::array<double, 3> inertia_kg_m2{};
  double lag_s = 0;  ///< of the motors
};

/// The loop of one axis. @param ratio force that acts per force commanded.
stability::Cascade flown_cascade(const GainFlight& flight, std::size_t axis, const CascadePlant& plant,
                                 double ratio);

/// Names and units of the entries of FlightParts::of().
const std::vector<std::string>& part_names();
const std::vector<std::string>& part_units();

/// Parts, remembered by gains and by flight.
class FlightParts {
 public:
  explicit FlightParts(CascadePlant plant) : plant_(plant) {}

  /// In m per unit: of force error, error of the estimated velocity and angular acceleration, the amplitude gain
  /// |h'|_1 and the edge gain sup |h|; then the largest error where force and error of the velocity are proportional to
  /// the set point's velocity. Infinite where the loop is unstable; zero where the axis has no such disturbance.
  /// @param ratio is rounded to 0.01.
  const std::vector<double>& of(const GainFlight& flight, std::size_t axis, double ratio);

 private:
  const std::vector<double>& norms(const GainFlight& flight, std::size_t axis, double ratio);

  CascadePlant plant_;
  std::map<std::string, std::vector<double>> norms_, parts_;
};

/// The height at which a vehicle without an integrator hovers off its set point: |g - thrust per mass|/Kp; zero with
/// one, and along horizontal axes.
double steady_error_m(const GainFlight& flight, std::size_t axis, double ratio);

}  // namespace swarmcert::reproduction

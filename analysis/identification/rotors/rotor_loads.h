/// @file The thrust of each rotor in slow flight according to the thrust map.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// Means over the records of a flight in which the vehicle neither climbs nor descends, well above the ground. There
/// the torques cancel, so differences between rotors are properties of the vehicle.
struct RotorLoads {
  std::string flight, vehicle;
  std::size_t records = 0;
  Eigen::Vector4d mean_N = Eigen::Vector4d::Zero();   ///< front right, back right, back left, front left
  Eigen::Vector4d error_N = Eigen::Vector4d::Zero();  ///< standard errors, from blocks of 1 s
};

/// Records are used below this vertical speed and at least this high above the lowest record.
inline constexpr double kMostClimb_m_s = 0.08, kLeastRise_m = 0.3;
/// Flights with less slow flight are skipped.
inline constexpr double kLeastSlowFlight_s = 3;

/// Returns the loads of each flight of vehicles of `kind` whose log has the duty, the command or the speed of each of
/// four rotors in X. The result does not depend on `jobs`.
std::vector<RotorLoads> rotor_loads(const residuals::Inputs& inputs, const std::string& kind, int jobs);

}  // namespace swarmcert::identification

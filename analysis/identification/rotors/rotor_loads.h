/// @file What each rotor of a vehicle gives in slow flight, as the thrust map has it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// Means over the records of one flight in which the vehicle neither climbs nor sinks, well above the ground. There the
/// torques cancel, so that the differences between rotors are those of the vehicle.
struct RotorLoads {
  std::string flight, vehicle;
  std::size_t records = 0;
  Eigen::Vector4d mean_N = Eigen::Vector4d::Zero();   ///< front right, back right, back left, front left
  Eigen::Vector4d error_N = Eigen::Vector4d::Zero();  ///< standard errors, from blocks of 1 s
};

/// Records count below this vertical speed and at least this high above the lowest record.
inline constexpr double kMostClimb_m_s = 0.08, kLeastRise_m = 0.3;
/// Flights with less slow flight than this are left out.
inline constexpr double kLeastSlowFlight_s = 3;

/// Of every flight of vehicles of `kind` whose log has a duty of each motor and the battery. Does not depend on `jobs`.
std::vector<RotorLoads> rotor_loads(const residuals::Inputs& inputs, const std::string& kind, int jobs);

}  // namespace swarmcert::identification

/// @file Where the rotors of a vehicle are, as far as its logs say.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stability/model.h"

namespace swarmcert::identification {

struct DraftedGeometry {
  std::vector<stability::RotorPlace> rotors;  ///< in the order of the motors
  double torque_per_thrust_m = 0;             ///< 0: not stated
  std::string source;                         ///< the log's parameters, or an assumption
};

/// `motors` rotors as PX4's control allocation states them (CA_ROTOR*: forward, right and down). Without such
/// parameters: four in X in the order that PX4 and ArduPilot share, other numbers evenly on a circle, at `arm_m`.
/// @param motors 3 to 8.
DraftedGeometry geometry_of(const std::map<std::string, double>& parameters, std::size_t motors,
                            double arm_m);

}  // namespace swarmcert::identification

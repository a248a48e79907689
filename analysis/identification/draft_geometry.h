/// @file Rotor geometry of a vehicle, as far as its logs state it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stability/model.h"

namespace swarmcert::identification {

struct DraftedGeometry {
  std::vector<stability::RotorPlace> rotors;  ///< in the order of the motors
  double torque_per_thrust_m = 0;             ///< 0: unknown
  std::string source;                         ///< the log's parameters, or an assumption
};

/// Returns `motors` rotors as given by PX4's control allocation parameters (CA_ROTOR*: forward, right and down).
/// Without such parameters, assumes four rotors in X configuration in the order shared by PX4 and ArduPilot, or any
/// other number evenly spaced on a circle, at `arm_m`.
/// @param motors 3 to 8
DraftedGeometry geometry_of(const std::map<std::string, double>& parameters, std::size_t motors,
                            double arm_m);

}  // namespace swarmcert::identification

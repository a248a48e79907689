/// @file The vehicle used in the tests.
#pragma once

#include "data.h"
#include "stability/model.h"

namespace swarmcert::tests {

/// Mass of the small published vehicle.
inline constexpr double kMass_kg = 0.034;

inline stability::Model small_vehicle() {
  return stability::read_model(source_path("stability/models/crazyflie-small.toml"));
}

}  // namespace swarmcert::tests

/// @file The kind of each vehicle of the swarm: edit this for your swarm.
#pragma once

#include <cstdint>

namespace swarmcert::crazyflie {

/// The last byte of a radio address, and the index of the vehicle's kind in the exported network (the comment above
/// deep_set() in swarmcert_network.h lists the kinds).
struct Vehicle {
  std::uint8_t id, kind;
};

/// Vehicles that are not listed are of kind 0.
inline constexpr Vehicle kVehicles[] = {{0, 0}};

inline int kind_of(std::uint8_t id) {
  for (const Vehicle& vehicle : kVehicles) {
    if (vehicle.id == id) return vehicle.kind;
  }
  return 0;
}

}  // namespace swarmcert::crazyflie

/// @file Properties of the two kinds of vehicle of the published networks and flights.
#pragma once

#include <string>

namespace swarmcert::residuals {

struct PublishedVehicle {
  const char* kind;
  double mass_kg;            ///< as weighed by the networks' authors, whose labels depend on it
  double standing_height_m;  ///< of the tracked centre when the vehicle is on the ground
};

/// Returns the properties; nullptr for other kinds.
inline const PublishedVehicle* published_vehicle(const std::string& kind) {
  static constexpr PublishedVehicle kPublished[] = {{"small", 0.032, 0.07}, {"large", 0.067, 0.085}};
  for (const PublishedVehicle& vehicle : kPublished)
    if (kind == vehicle.kind) return &vehicle;
  return nullptr;
}

}  // namespace swarmcert::residuals

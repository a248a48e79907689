/// @file What the published networks and flights take for granted about their two kinds of vehicle.
#pragma once

#include <string>

namespace swarmcert::residuals {

struct PublishedVehicle {
  const char* kind;
  double mass_kg;            ///< what the networks' authors weighed; their labels rest on it
  double standing_height_m;  ///< position of the tracked centre on the ground
};

/// Nothing for other kinds.
inline const PublishedVehicle* published_vehicle(const std::string& kind) {
  static constexpr PublishedVehicle kPublished[] = {{"small", 0.032, 0.07}, {"large", 0.067, 0.085}};
  for (const PublishedVehicle& vehicle : kPublished)
    if (kind == vehicle.kind) return &vehicle;
  return nullptr;
}

}  // namespace swarmcert::residuals

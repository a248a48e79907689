/// @file Properties of the two kinds of vehicle of the published networks and flights.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::residuals {

struct PublishedVehicle {
  const char* kind;
  double mass_kg;            ///< as weighed by the networks' authors, whose labels depend on it
  double standing_height_m;  ///< of the tracked centre when the vehicle is on the ground
};

/// A stage of their error budget: the effects of the model up to it, and whether vehicles have constant forces.
struct PublishedStage {
  const char* name;
  std::vector<std::string> effects;
  bool has_offsets;
};
inline const std::vector<PublishedStage>& published_stages() {
  static const std::vector<PublishedStage> stages = {
      {"lag", {"motor_lag"}, false},
      {"offset", {"motor_lag"}, true},
      {"ground", {"motor_lag", "ground"}, true},
      {"jet", {"motor_lag", "ground", "downwash"}, true},
      {"rest", {"motor_lag", "ground", "downwash", "upper_lift", "drag_linear", "battery", "inflow"}, true}};
  return stages;
}

/// Returns the properties; nullptr for other kinds.
inline const PublishedVehicle* published_vehicle(const std::string& kind) {
  static constexpr PublishedVehicle kPublished[] = {{"small", 0.032, 0.07}, {"large", 0.067, 0.085}};
  for (const PublishedVehicle& vehicle : kPublished)
    if (kind == vehicle.kind) return &vehicle;
  return nullptr;
}

}  // namespace swarmcert::residuals

#include "analysis/identification/draft_geometry.h"

#include <fmt/core.h>

#include <cmath>

#include "nn/base/pi.h"

namespace swarmcert::identification {
namespace {

/// Largest component of a rotor's axis in the plane of the body: 10 degrees.
constexpr double kMostTilt = 0.17;

/// Returns the geometry given by the parameters; no rotors if it is not given or if a rotor does not push upwards.
DraftedGeometry stated_geometry(const std::map<std::string, double>& parameters, std::size_t motors) {
  DraftedGeometry stated;
  const auto value = [&](std::size_t k, const char* what, double otherwise) {
    const auto found = parameters.find(fmt::format("CA_ROTOR{}_{}", k, what));
    return found == parameters.end() ? otherwise : found->second;
  };
  const auto count = parameters.find("CA_ROTOR_COUNT");
  if (count == parameters.end() || count->second != static_cast<double>(motors)) return stated;
  double farthest_m = 0;
  for (std::size_t k = 0; k < motors; ++k) {
    const double moment_m = value(k, "KM", 0.05);
    const double ax = value(k, "AX", 0), ay = value(k, "AY", 0), az = value(k, "AZ", -1);
    if (!(std::hypot(ax, ay) <= kMostTilt * std::abs(az)) || az >= 0) return {};
    stated.rotors.push_back({value(k, "PX", 0), 0 - value(k, "PY", 0), 0 - value(k, "PZ", 0), moment_m >= 0});
    stated.torque_per_thrust_m += std::abs(moment_m) / static_cast<double>(motors);
    farthest_m = std::max(farthest_m, std::hypot(stated.rotors.back().x_m, stated.rotors.back().y_m));
  }
  // Airframes that have not been measured have all rotors at the centre.
  if (!(farthest_m > 0.01)) return {};
  stated.source = "log parameters CA_ROTOR*";
  return stated;
}

}  // namespace

DraftedGeometry geometry_of(const std::map<std::string, double>& parameters, std::size_t motors,
                            double arm_m) {
  DraftedGeometry geometry = stated_geometry(parameters, motors);
  if (!geometry.rotors.empty()) return geometry;
  if (motors == 4) {
    const double d = arm_m * std::sqrt(0.5);
    geometry.rotors = {{d, -d, 0, true}, {-d, d, 0, true}, {d, d, 0, false}, {-d, -d, 0, false}};
    geometry.source = "assumption: four in X, in the order of PX4 and ArduPilot";
    return geometry;
  }
  for (std::size_t k = 0; k < motors; ++k) {
    const double angle = (static_cast<double>(k) + 0.5) * 2 * kPi / static_cast<double>(motors);
    geometry.rotors.push_back({arm_m * std::cos(angle), arm_m * std::sin(angle), 0, k % 2 == 0});
  }
  geometry.source = fmt::format(
      "assumption: {} evenly on a circle; their order is not known, so torques cannot be judged yet", motors);
  return geometry;
}

}  // namespace swarmcert::identification

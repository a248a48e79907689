/// @file The unit in which forces are displayed.
#pragma once

#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "analysis/residuals/inputs.h"

namespace swarmcert::residuals {

struct ForceUnit {
  const char* name = "N";
  double size_N = 1;

  double per_newton() const { return 1 / size_N; }
};

/// @param name "N" (mN for vehicles that weigh less than 10 N), "gf" or "m_s2" (force over the model's mass)
inline ForceUnit chosen_force_unit(const std::string& name, const stability::Model& model) {
  constexpr double kHeavy_N = 10;
  if (name == "gf") return {"gf", stability::kGramForce_N};
  if (name == "m_s2") return {"m/s^2", model.mass_kg};
  return model.weight_N() < kHeavy_N ? ForceUnit{"mN", 1e-3} : ForceUnit{"N", 1};
}

/// Returns gram-force, the unit of the published networks, if each vehicle weighs less than 1 N; otherwise newton.
/// Without a known mass, the model has 1 kg and its residuals are accelerations.
inline ForceUnit force_unit(const Inputs& inputs) {
  constexpr double kLight_N = 1;
  if (inputs.rules.per_mass) return {"m/s^2", 1};
  const bool light = std::all_of(inputs.models.begin(), inputs.models.end(),
                                 [](const stability::Model& m) { return m.weight_N() < kLight_N; });
  return light ? ForceUnit{"gf", stability::kGramForce_N} : ForceUnit{};
}

/// Formats a mass: "34.0 g", "2.5 kg".
inline std::string mass_text(double mass_kg) {
  return mass_kg < 1 ? fmt::format("{:.1f} g", 1000 * mass_kg) : fmt::format("{:.4g} kg", mass_kg);
}

}  // namespace swarmcert::residuals

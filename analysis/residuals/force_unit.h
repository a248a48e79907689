/// @file The unit in which a run displays its forces.
#pragma once

#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <vector>

#include "stability/model.h"

namespace swarmcert::residuals {

struct ForceUnit {
  const char* name = "N";
  double size_N = 1;

  double per_newton() const { return 1 / size_N; }
};

/// @param name "N" or empty (mN if each vehicle weighs less than 10 N), "gf" or "m_s2" (over the mass of the first)
inline ForceUnit force_unit(const std::string& name, const std::vector<stability::Model>& models) {
  constexpr double kHeavy_N = 10;
  if (name == "gf") return {"gf", stability::kGramForce_N};
  if (name == "m_s2") return {"m/s^2", models[0].mass_kg};
  const bool is_light = std::all_of(models.begin(), models.end(),
                                    [](const stability::Model& m) { return m.weight_N() < kHeavy_N; });
  return is_light ? ForceUnit{"mN", 1e-3} : ForceUnit{};
}

/// Formats a mass: "34.0 g", "2.5 kg".
inline std::string mass_text(double mass_kg) {
  return mass_kg < 1 ? fmt::format("{:.1f} g", 1000 * mass_kg) : fmt::format("{:.4g} kg", mass_kg);
}

}  // namespace swarmcert::residuals

/// Bounds on the coefficients of effects for vehicles of any mass.
#include <gtest/gtest.h>

#include <string>

#include "nn/base/input_error.h"
#include "stability/effects/registry.h"
#include "stability/model.h"

namespace swarmcert::tests {
namespace {

using stability::EffectInfo;

double largest_coefficient(const std::string& effect, double mass_kg) {
  EffectInfo info = stability::effect_info(effect);
  stability::scale_bounds(mass_kg, info);
  return info.linear[0].upper;
}

TEST(EffectBounds, OfForcesAndTorquesGrowWithTheWeight) {
  // Stated for the published vehicles, of 34 g and 67 g.
  for (const std::string& effect : stability::effect_names()) {
    if (stability::effect_info(effect).linear.empty()) continue;
    for (const double mass_kg : {0.034, 0.067})
      EXPECT_EQ(largest_coefficient(effect, mass_kg), stability::effect_info(effect).linear[0].upper)
          << effect;
  }
  for (const char* const effect :
       {"drag_linear", "drag_quadratic", "drag_rotor", "constant_force", "torque_bias", "tether"})
    EXPECT_DOUBLE_EQ(largest_coefficient(effect, 0.67), 10 * largest_coefficient(effect, 0.067)) << effect;
  // A share of the thrust, or an offset in metres, has the same bounds for all vehicles.
  for (const char* const effect : {"thrust_ratio", "ground", "com_offset"})
    EXPECT_EQ(largest_coefficient(effect, 0.67), largest_coefficient(effect, 0.067)) << effect;
}

/// Returns the error for a vehicle of `mass_kg`, with a thrust of twice its weight, and a drag of 0.35 N s/m; empty if
/// it is accepted.
std::string refusal_of_drag(double mass_kg) {
  const std::string inertia = std::to_string(0.01 * mass_kg), thrust_N = std::to_string(5 * mass_kg);
  const std::string text =
      "schema = \"swarmcert/model/1\"\n[vehicle]\nkind = \"any\"\nmass_kg = " + std::to_string(mass_kg) +
      "\ninertia_kg_m2 = [" + inertia + ", " + inertia + ", " + inertia +
      "]\narm_m = 0.2\ntorque_per_thrust_m = 0.016\n" + "[vehicle.thrust_curve]\nforce_N = [0, 0, " +
      thrust_N + "]\n" + "[[effect]]\nname = \"drag_linear\"\nparameters = { drag_N_s_m = 0.35 }\n";
  try {
    stability::parse_model(text, "model.toml");
  } catch (const files::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(EffectBounds, OfAModelFileAreThoseOfItsVehicle) {
  EXPECT_EQ(refusal_of_drag(1.3), "");
  EXPECT_NE(refusal_of_drag(0.034).find("drag_N_s_m = 0.350000: must lie in [0.000000, 0.300000]"),
            std::string::npos)
      << refusal_of_drag(0.034);
}

}  // namespace
}  // namespace swarmcert::tests

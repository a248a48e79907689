/// Bounds on the coefficients of effects for vehicles of any mass.
#include <gtest/gtest.h>

#include <string>

#include "nn/base/input_error.h"
#include "stability/effects/registry.h"
#include "stability/model.h"

namespace swarmcert::tests {
namespace {

double largest_coefficient(const std::string& effect, double mass_kg, double arm_m) {
  stability::Model model;
  model.mass_kg = mass_kg;
  model.arm_m = arm_m;
  return stability::effect_info(effect, model).linear[0].upper;
}

TEST(EffectBounds, AreMultiplesOfWeightArmAndBodyLengthsPerSecond) {
  const double ten = 10 * largest_coefficient("constant_force", 0.067, 0.06);
  EXPECT_DOUBLE_EQ(largest_coefficient("constant_force", 0.67, 0.12), ten);
  EXPECT_DOUBLE_EQ(ten, 0.67 * 9.81);
  const auto growth = [](const std::string& effect) {
    return largest_coefficient(effect, 0.67, 0.12) / largest_coefficient(effect, 0.067, 0.06);
  };
  EXPECT_DOUBLE_EQ(growth("torque_bias"), 20);
  EXPECT_DOUBLE_EQ(growth("com_offset"), 2);
  EXPECT_DOUBLE_EQ(growth("payload_step"), 10);
  for (const char* const drag : {"drag_linear", "drag_rotor", "tether"})
    EXPECT_DOUBLE_EQ(growth(drag), 5) << drag;
  EXPECT_DOUBLE_EQ(growth("drag_quadratic"), 2.5);
  // A share of the thrust has the same bounds for all vehicles.
  for (const char* const share : {"thrust_ratio", "ground"}) EXPECT_EQ(growth(share), 1) << share;
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
  EXPECT_NE(refusal_of_drag(0.034).find("drag_N_s_m = 0.350000: must lie in [0.000000, 0.083385]"),
            std::string::npos)
      << refusal_of_drag(0.034);
}

}  // namespace
}  // namespace swarmcert::tests

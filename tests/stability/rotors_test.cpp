/// Vehicles other than four rotors in X.
#include <gtest/gtest.h>

#include "nn/base/input_error.h"
#include "stability/model.h"
#include "stability/simulation/swarm.h"

namespace swarmcert::stability {
namespace {

const std::string kHexacopter = R"(schema = "swarmcert/model/1"
[vehicle]
kind = "hexacopter"
mass_kg = 2.2
inertia_kg_m2 = [0.03, 0.03, 0.05]
torque_per_thrust_m = 0.016
battery_range_V = [12.0, 17.0]
rotors = [
  { position_m = [0.0, -0.27, 0.02], spin = "cw" },
  { position_m = [0.0, 0.27, 0.02], spin = "ccw" },
  { position_m = [0.234, 0.135, 0.0], spin = "cw" },
  { position_m = [-0.234, -0.135, 0.0], spin = "ccw" },
  { position_m = [0.234, -0.135, 0.0], spin = "ccw" },
  { position_m = [-0.234, 0.135, 0.0], spin = "cw" },
]
[vehicle.thrust_curve]
force_N = [0.1, 1.5, 7.0]
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

/// Returns the error message for `text`, or "" if it is accepted.
std::string refusal_of(const std::string& text) {
  try {
    parse_model(text, "m.toml");
  } catch (const files::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Rotors, PlacesSpinsAndThrustOfAHexacopterAreReadAndWrittenBack) {
  const Model model = parse_model(kHexacopter, "m.toml");
  ASSERT_EQ(model.num_rotors(), 6u);
  EXPECT_EQ(model.rotors[2].x_m, 0.234);
  EXPECT_EQ(model.rotors[3].y_m, -0.135);
  EXPECT_FALSE(model.rotors[0].counterclockwise);
  EXPECT_TRUE(model.rotors[1].counterclockwise);
  EXPECT_NEAR(model.arm_m, 0.27, 1e-3) << "mean distance of the rotors";
  // 0.1 + 1.5 u + 7 u^2 newton, independent of the voltage.
  EXPECT_NEAR(model.thrust.force_N(0.5, 12), 2.6, 1e-12);
  EXPECT_NEAR(model.thrust.force_N(0.5, 17), 2.6, 1e-12);
  EXPECT_NEAR(model.largest_thrust_N(14), 6 * 8.6, 1e-12);
  const Model again = parse_model(to_toml(model), "m.toml");
  EXPECT_EQ(to_toml(again), to_toml(model));
  EXPECT_EQ(again.thrust_curve_N, model.thrust_curve_N);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(again.rotors[k].x_m, model.rotors[k].x_m);
    EXPECT_EQ(again.rotors[k].counterclockwise, model.rotors[k].counterclockwise);
  }
}

TEST(Rotors, WithoutPlacesTheyAreFourInX) {
  Model model;
  model.arm_m = 0.1;
  const std::vector<RotorPlace> places = rotor_places(model);
  ASSERT_EQ(places.size(), 4u);
  // Front right, counterclockwise: its thrust rolls the vehicle to the left, its reaction yaws it to the right.
  EXPECT_GT(places[0].x_m, 0);
  EXPECT_LT(places[0].y_m, 0);
  EXPECT_EQ(places[0].yaw_m(0.006), -0.006);
}

TEST(Rotors, VehiclesFrom20GramTo20KilogramAreRead) {
  const std::string light = R"(schema = "swarmcert/model/1"
[vehicle]
kind = "tricopter"
mass_kg = 0.02
inertia_kg_m2 = [4e-6, 4e-6, 7e-6]
torque_per_thrust_m = 0.005
rotors = [ { position_m = [0.03, -0.02, 0], spin = "cw" }, { position_m = [0.03, 0.02, 0], spin = "ccw" },
           { position_m = [-0.04, 0, 0], spin = "cw" } ]
[vehicle.thrust_curve]
force_N = [0.0, 0.05, 0.08]
)";
  EXPECT_EQ(parse_model(light, "m.toml").num_rotors(), 3u);
  const std::string heavy = R"(schema = "swarmcert/model/1"
[vehicle]
kind = "octocopter"
mass_kg = 20
inertia_kg_m2 = [1.6, 1.6, 2.9]
torque_per_thrust_m = 0.03
battery_range_V = [40, 51]
rotors = [ { position_m = [0.7, 0, 0], spin = "cw" }, { position_m = [0.5, 0.5, 0], spin = "ccw" },
           { position_m = [0, 0.7, 0], spin = "cw" }, { position_m = [-0.5, 0.5, 0], spin = "ccw" },
           { position_m = [-0.7, 0, 0], spin = "cw" }, { position_m = [-0.5, -0.5, 0], spin = "ccw" },
           { position_m = [0, -0.7, 0], spin = "cw" }, { position_m = [0.5, -0.5, 0], spin = "ccw" } ]
[vehicle.thrust_curve]
force_N = [0, 5, 45]
)";
  EXPECT_EQ(refusal_of(heavy), "");
}

TEST(Rotors, RefusesWhatCannotFly) {
  const auto says = [](const std::string& text, const std::string& words) {
    const std::string refusal = refusal_of(text);
    EXPECT_NE(refusal.find(words), std::string::npos) << refusal;
  };
  const std::string two =
      "rotors = [ { position_m = [0.2, 0, 0], spin = \"cw\" }, "
      "{ position_m = [-0.2, 0, 0], spin = \"ccw\" } ]\n";
  const std::size_t start = kHexacopter.find("rotors = ["),
                    end = kHexacopter.find("]\n[vehicle.thrust_curve]");
  const std::string body = kHexacopter.substr(start, end + 2 - start);
  says(with(kHexacopter, body, two), "3 to 8 rotors");
  const std::string line =
      "rotors = [ { position_m = [0.2, 0, 0], spin = \"cw\" }, { position_m = [0.1, 0, 0], spin = "
      "\"cw\" }, { position_m = [-0.2, 0, 0], spin = \"ccw\" } ]\n";
  says(with(kHexacopter, body, line), "lie on one line");
  says(with(kHexacopter, "mass_kg = 2.2", "mass_kg = 2.2\narm_m = 0.27"), "cannot be combined with rotors");
  says(with(kHexacopter, "spin = \"cw\"", "spin = \"left\""), "spin");
  says(with(kHexacopter, "force_N = [0.1, 1.5, 7.0]", "force_N = [0.1, 1.5, -7.0]"), "does not increase");
  says(with(kHexacopter, "force_N = [0.1, 1.5, 7.0]", "force_N = [0.1, 1.5]"), "[a, b, c]");
  says(with(kHexacopter, "force_N = [0.1, 1.5, 7.0]", "force_N = [0.0, 0.1, 0.7]"), "6 rotors give 4.8 N");
  says(with(kHexacopter, "mass_kg = 2.2", "mass_kg = 2200"), "6 rotors");
}

TEST(Rotors, OtherThanFourInXAreNotSimulated) {
  try {
    const Swarm swarm(parse_model(kHexacopter, "m.toml"), 1);
    FAIL() << "the simulator has four rotors";
  } catch (const files::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("four rotors in X"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace swarmcert::stability

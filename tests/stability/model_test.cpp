#include "stability/model.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "data.h"
#include "nn/base/input_error.h"
#include "stability/effects/registry.h"

namespace swarmcert::stability {
namespace {

const std::string kVehicle = R"(schema = "swarmcert/model/1"
[vehicle]
kind = "small"
mass_kg = 0.034
inertia_kg_m2 = [16e-6, 16e-6, 29e-6]
arm_m = 0.046
torque_per_thrust_m = 0.006
[vehicle.thrust]
c00 = 0.0
c10 = 20.0
c01 = 0.0
c20 = 0.0
c11 = 0.0
)";

/// Returns the error message for `text`, or "" if it is accepted.
std::string refusal(const std::string& text) {
  try {
    parse_model(text, "m.toml");
  } catch (const files::InputError& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(Model, ReadsTheShippedCrazyflies) {
  const Model small = read_model(tests::source_path("stability/models/crazyflie-small.toml"));
  const Model large = read_model(tests::source_path("stability/models/crazyflie-large.toml"));
  EXPECT_EQ(small.mass_kg, 0.034);
  EXPECT_EQ(large.mass_kg, 0.067);
  EXPECT_EQ(small.kind, "small");
  EXPECT_TRUE(small.effects.empty());
  EXPECT_TRUE(large.effects.empty());
  // Hover at full battery: the mapped thrust of four rotors equals the weight at a plausible PWM.
  for (const Model& model : {small, large}) {
    const double pwm = model.thrust.pwm(model.weight_N() / 4, kFullBattery_V);
    EXPECT_GT(pwm, 0.4);
    EXPECT_LT(pwm, 0.9);
    EXPECT_NEAR(4 * model.thrust.force_N(pwm, kFullBattery_V), model.weight_N(), 1e-12);
  }
}

TEST(Model, PwmInvertsTheThrustMapWhereItReachesAndSaturatesElsewhere) {
  const ThrustMap map = read_model(tests::source_path("stability/models/crazyflie-small.toml")).thrust;
  int inside = 0;
  for (double battery_V = 3.3; battery_V < 4.21; battery_V += 0.1) {
    for (double force_N = 0; force_N < 0.3; force_N += 0.01) {
      const double pwm = map.pwm(force_N, battery_V);
      ASSERT_GE(pwm, 0);
      ASSERT_LE(pwm, 1);
      // Below the minimum of the parabola no PWM gives such a small force.
      const double vertex = -(map.c10 + map.c11 * battery_V / 4.2) / (2 * map.c20);
      if (pwm > std::max(vertex, 0.0) + 1e-9 && pwm < 1) {
        EXPECT_NEAR(map.force_N(pwm, battery_V), force_N, 1e-12);
        ++inside;
      }
      if (pwm == 1) {
        EXPECT_LE(map.largest_N(battery_V), force_N + 1e-12);
      }
    }
  }
  EXPECT_GT(inside, 100);
}

TEST(Model, RotorForcesAreThoseOfTheFlightCodeAndNeverNegative) {
  ThrustMap map{};
  map.c00 = -2, map.c10 = 10, map.c20 = 12, map.c11 = 1;  // negative up to p = 0.16
  EXPECT_EQ(map.force_N(0, kFullBattery_V), 0);
  int positive = 0;
  for (double battery_V = 3.3; battery_V < 4.21; battery_V += 0.1) {
    for (double pwm = 0; pwm <= 1; pwm += 0.01) {
      const double force_N = map.force_N(pwm, battery_V);
      ASSERT_GE(force_N, 0);
      ASSERT_EQ(force_N, controller::force_of_pwm<double>(map, pwm, battery_V));
      positive += force_N > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(positive, 500);
}

TEST(Model, ReadsBackWhatItWrites) {
  Model model = parse_model(kVehicle + R"toml(
[sensor]
accelerometer_cutoff_hz = 42.5
[[effect]]
name = "ground"
parameters = { amplitude = 0.164, decay_m = 0.0268 }
[effect.fit]
flights = ["a/\"b\"_00", "c"]
interval = { amplitude = [0.15, 0.18] }
select_rmse_before_N = 0.01
select_rmse_after_N = 0.006
test_looks = 2
note = "line\nbreak"
[[effect]]
name = "dip"
parameters = { a = -0.01, w = 0.05 }
[effect.expression]
force_b3_N = "a * T * exp(-((z - 0.18) / w)^2 / 2)"
linear = ["a"]
bounds = { a = [-0.05, 0.0] }
grid = { w = [0.03, 0.05] }
)toml",
                            "m.toml");
  LadderRow row;
  row.effect = "flow_torque";
  row.measure = LadderMeasure{"error of body rates", "rad/s", {0.5, 0.25}, {0.625, 0.375}};
  LadderRow nominal;
  nominal.effect = "nominal";
  model.ladder = {nominal, row};
  const std::string text = to_toml(model, {"a comment"});
  const Model again = parse_model(text, "n.toml");
  EXPECT_EQ(to_toml(again, {"a comment"}), text);
  EXPECT_EQ(again.effects[0].fit.flights, model.effects[0].fit.flights);
  EXPECT_EQ(again.effects[0].fit.note, "line\nbreak");
  EXPECT_EQ(again.effects[1].expression.formulas, model.effects[1].expression.formulas);
  EXPECT_FALSE(again.ladder[0].measure);
  ASSERT_TRUE(again.ladder[1].measure);
  EXPECT_EQ(again.ladder[1].measure->quantity, row.measure->quantity);
  EXPECT_EQ(again.ladder[1].measure->select, row.measure->select);
  EXPECT_EQ(again.ladder[1].measure->test, row.measure->test);
  EXPECT_EQ(again.sensor.accelerometer_cutoff_hz, 42.5);
  EXPECT_EQ(again.inertia_kg_m2, model.inertia_kg_m2);
}

TEST(Model, RefusesWhatCannotBeWithLineAndMend) {
  ASSERT_EQ(refusal(kVehicle), "");
  const auto has = [](const std::string& message, const std::string& words) {
    EXPECT_NE(message.find(words), std::string::npos) << message << "\nlacks: " << words;
  };
  has(refusal(replaced(kVehicle, "mass_kg = 0.034", "mass_kg = 0.0")), "line 4: vehicle.mass_kg = 0");
  has(refusal(replaced(kVehicle, "mass_kg", "mass_g")), "did you mean \"mass_kg\"?");
  has(refusal(replaced(kVehicle, "model/1", "network/1")), "is this the right file?");
  has(refusal(replaced(kVehicle, "c10 = 20.0", "c10 = 0.2")), "the vehicle weighs");
  has(refusal(kVehicle + "[[effect]]\nname = \"grund\"\n"), "did you mean \"ground\"?");
  has(refusal(kVehicle + "[[effect]]\nname = \"ground\"\nparameters = { amplitud = 0.1 }\n"),
      "did you mean \"amplitude\"?");
  has(refusal(kVehicle + "[[effect]]\nname = \"drag_linear\"\nparameters = { drag_N_s_m = -0.1 }\n"),
      "must lie in");
  has(refusal(kVehicle + "[[effect]]\nname = \"ground\"\n[[effect]]\nname = \"ground\"\n"), "appears twice");
  has(refusal(kVehicle + "[[effect]]\nname = \"mine\"\n"), "add [effect.expression]");
}

TEST(Model, RefusesNumbersInOtherUnits) {
  const auto has = [](const std::string& message, const std::string& words) {
    EXPECT_NE(message.find(words), std::string::npos) << message << "\nlacks: " << words;
  };
  const auto inertia = [](const std::string& numbers) {
    return refusal(replaced(kVehicle, "[16e-6, 16e-6, 29e-6]", numbers));
  };
  EXPECT_EQ(inertia("[16e-6, 16e-6, 33e-6]"), "")
      << "a little more than a rigid body has is a measuring error";
  has(inertia("[16, 16e-6, 29e-6]"), "line 5: vehicle.inertia_kg_m2 = 16: is more than twice");
  has(inertia("[160, 160, 290]"), "the mass lies 92.4 m from the axis, but the rotors are at 0.046 m");
  has(inertia("[160, 160, 290]"), "1 g cm^2 is 1e-7");
  has(refusal(replaced(kVehicle, "arm_m = 0.046", "arm_m = 46")), "the rotors are at 46 m");
  has(refusal(replaced(kVehicle, "m = 0.006", "m = 6")),
      "vehicle.torque_per_thrust_m = 6: is more than arm_m");
  const std::string grams = refusal(replaced(kVehicle, "mass_kg = 0.034", "mass_kg = 34"));
  has(grams, "line 4: vehicle.mass_kg = 34: weighs 333.5 N");
  has(grams, "34 g is 0.034");
  has(refusal(replaced(kVehicle, "mass_kg = 0.034", "mass_kg = 34e-6")), "vehicle.mass_kg = 3.4e-05: weighs");
  has(refusal(replaced(kVehicle, "arm_m = 0.046", "arm_m = 46")), "vehicle.arm_m = 46");
  has(refusal(replaced(kVehicle, "arm_m = 0.046", "arm_m = 46")), "46 mm is 0.046");
  const std::string newton = refusal(replaced(kVehicle, "c10 = 20.0", "c10 = 0.196"));
  has(newton, "vehicle.thrust: 4 rotors give 0.007691 N");
  has(newton, "gram-force (not newton)");
  has(refusal(replaced(kVehicle, "c10 = 20.0", "c10 = 20.0e-4")), "not percent or counts");
  has(refusal(kVehicle + "[sensor]\nlog_rate_hz = 1e9\n"), "sensor.log_rate_hz = 1e+09: is above 100000 Hz");
  has(refusal(replaced(kVehicle, "[vehicle.thrust]", "battery_range_V = [3000, 4200]\n[vehicle.thrust]")),
      "4200 mV is 4.2");
}

TEST(Model, StatesTheRangeOfItsBatteryOrHasThatOfOneCell) {
  const Model one = parse_model(kVehicle, "m.toml");
  EXPECT_EQ(battery_problem(one, 3.7), "");
  EXPECT_NE(battery_problem(one, 42), "");
  EXPECT_NE(battery_problem(one, 3700).find("3700 mV is 3.7"), std::string::npos);
  EXPECT_NE(battery_problem(one, 0), "");
  const Model three = parse_model(
      replaced(kVehicle, "[vehicle.thrust]", "battery_range_V = [9, 13]\n[vehicle.thrust]"), "m.toml");
  EXPECT_EQ(battery_problem(three, 11.1), "");
  EXPECT_NE(battery_problem(three, 3.7).find("m.toml, 9 .. 13 V"), std::string::npos)
      << battery_problem(three, 3.7);
  EXPECT_EQ(parse_model(to_toml(three), "n.toml").battery_range_V, three.battery_range_V);
  EXPECT_EQ(parse_model(to_toml(one), "n.toml").battery_range_V, one.battery_range_V);
}

TEST(Model, RefusesFormulasThatAreWrongOrNotLinearWhereTheySaySo) {
  const auto message = [](const std::string& formula, const std::string& linear) {
    return refusal(kVehicle +
                   "[[effect]]\nname = \"mine\"\nparameters = { a = 0.1, b = 0.2 }\n[effect.expression]\n" +
                   "force_z_N = \"" + formula + "\"\nlinear = [" + linear + "]\n");
  };
  EXPECT_EQ(message("a * z * exp(-b * z)", "\"a\""), "");
  EXPECT_EQ(message("a * z + b * vx", "\"a\", \"b\""), "");
  EXPECT_NE(message("a * z + b", "\"a\"").find("not linear"), std::string::npos);
  EXPECT_NE(message("a * z * exp(-b * z)", "\"a\", \"b\"").find("not linear"), std::string::npos);
  EXPECT_NE(message("a * (z", "\"a\"").find("is not a formula"), std::string::npos);
  EXPECT_NE(message("a * zz", "\"a\"").find("zz"), std::string::npos);
  EXPECT_NE(message("a * dz", "\"a\"").find("dz"), std::string::npos) << "dz needs per_neighbour";
}

}  // namespace
}  // namespace swarmcert::stability

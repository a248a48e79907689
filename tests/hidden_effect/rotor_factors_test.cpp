/// A weak rotor in simulation: `add` fits the rotor factors, and `diagnose --each` shows them.
#include <gtest/gtest.h>

#include <string>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

constexpr int kRotorFlights = 5;
constexpr double kWeakFactor = 0.85;

class WeakRotor : public testing::Test {
 protected:
  WeakRotor() : model_(source_path("stability/models/crazyflie-small.toml")) {
    write_text(
        folder_ / "truth.toml",
        read_text(model_) + "\n[[effect]]\nname = \"rotor_thrust\"\nparameters = { rotor_3 = 0.85 }\n");
    for (int run = 0; run < kRotorFlights; ++run) {
      const std::string number = std::to_string(run);
      const Outcome outcome =
          run_shell("swarmcert simulate takeoff -q --vehicles 1 --duration 30 --seed " + number + " --run " +
                        number + " --force --model truth.toml --gains " +
                        source_path("controller/gains/crazyflie-small.toml") + " -o flights",
                    folder_.path());
      EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    }
  }

  files::Json result(const std::string& command, const std::string& schema, int exit_code) {
    const Outcome outcome =
        run_shell("swarmcert " + command + " -q --force --json result.json", folder_.path());
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.output;
    return files::read_json(folder_ / "result.json", "swarmcert/" + schema + "/1");
  }

  const ScratchFolder folder_;
  const std::string model_;
};

TEST_F(WeakRotor, HasItsFactorInTheModelThatAddWrites) {
  const files::Json added =
      result("add rotor_thrust --model " + model_ + " flights -o fitted.toml", "add", 0);
  ASSERT_EQ(added["ladder"].size(), 2u);
  EXPECT_TRUE(added["ladder"][1]["accepted"].get<bool>()) << added["ladder"].dump(1);
  ASSERT_EQ(added["effects"].size(), 1u) << added["effects"].dump(1);
  const files::Json& numbers = added["effects"][0]["parameters"];
  for (int k = 1; k <= 4; ++k) {
    const std::string name = "rotor_" + std::to_string(k);
    EXPECT_NEAR(numbers[name]["value"].get<double>(), k == 3 ? kWeakFactor : 1, 0.02) << name;
    const files::Json& interval = numbers[name]["interval_90"];
    EXPECT_LE(interval[0].get<double>(), k == 3 ? kWeakFactor : 1)
        << name << " of flights that repeat each other";
    EXPECT_GE(interval[1].get<double>(), k == 3 ? kWeakFactor : 1) << name;
  }
  EXPECT_NE(read_text(folder_ / "fitted.toml").find("rotor_3"), std::string::npos);
  const files::Json again = result("add rotor_thrust --model fitted.toml flights -o again.toml", "add", 0);
  EXPECT_FALSE(again["ladder"].back()["accepted"].get<bool>()) << "the model has the factors already";
}

TEST_F(WeakRotor, HasItsFactorInTheTableOfFlights) {
  const files::Json table = result("diagnose " + model_ + " flights --each", "diagnose", 0);
  ASSERT_EQ(table["each"].size(), static_cast<std::size_t>(kRotorFlights));
  for (const files::Json& row : table["each"]) {
    ASSERT_FALSE(row["rotor_3"].is_null()) << row.dump(1);
    ASSERT_FALSE(row["rotor_1"].is_null()) << row.dump(1);
    EXPECT_NEAR(row["rotor_3"]["value"].get<double>() / row["rotor_1"]["value"].get<double>(), kWeakFactor,
                0.03);
  }
  EXPECT_FALSE(table["each_days"][0]["rotor_3"].is_null());
}

}  // namespace
}  // namespace swarmcert::tests

/// Flights of a vehicle with an effect that the model does not know: compare, diagnose, add, compare again.
/// Truths are written as formulas where the library's own form would be the fitted one.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "analysis/run.h"
#include "data.h"
#include "nn/files/json.h"

namespace swarmcert::tests {
namespace {

/// What the plant has and the model lacks, as [[effect]] tables.
struct Truth {
  const char* name;
  const char* effects;
  std::set<std::string> answers;  ///< names that are right
  bool other_form = false;  ///< none of the library's forms fits all of it: others may take what is left
};

constexpr const char* kLag = "[[effect]]\nname = \"motor_lag\"\nparameters = { tau_s = 0.06 }\n";

std::string expression(const std::string& name, const std::string& formula, const std::string& parameters,
                       const std::string& linear, bool per_neighbour = false) {
  return "[[effect]]\nname = \"" + name + "\"\nparameters = { " + parameters + " }\n[effect.expression]\n" +
         formula + "\nlinear = [\"" + linear + "\"]\n" + (per_neighbour ? "per_neighbour = true\n" : "");
}

const std::string& lorentzian_jet() {
  static const std::string text = expression(
      "hidden_jet", "force_z_N = \"-a * max(0, min(1, (dz - 0.05) / 0.07)) / (1 + (dx^2 + dy^2) / 0.0064)\"",
      "a = 0.09", "a", true);
  return text;
}

std::vector<Truth> truths() {
  return {
      {"thrust_ratio",
       "[[effect]]\nname = \"thrust_ratio\"\nparameters = { ratio = -0.08 }\n",
       {"thrust_ratio"}},
      {"battery", "[[effect]]\nname = \"battery\"\nparameters = { sensitivity_1_V = 0.25 }\n", {"battery"}},
      {"drag_linear",
       "[[effect]]\nname = \"drag_linear\"\nparameters = { drag_N_s_m = 0.02 }\n",
       {"drag_linear"}},
      {"wind",
       "[[effect]]\nname = \"constant_force\"\nparameters = { force_x_N = 0.02, force_y_N = 0.01 }\n",
       {"constant_force"}},
      {"jet of Lorentzian shape", lorentzian_jet().c_str(), {"downwash"}, true},
  };
}

class Loop {
 public:
  explicit Loop(const ScratchFolder& folder) : folder_(folder) {
    nominal_ = read_text(source_path("stability/models/crazyflie-small.toml"));
  }

  /// Flies `effects` for 40 s, two vehicles on random walks, into the folder `name`.
  void fly(const std::string& name, const std::string& effects, int seed) {
    write_text(folder_ / (name + "_truth.toml"), nominal_ + "\n" + kLag + "\n" + effects);
    demand("swarmcert simulate random-walk -q --vehicles 2 --duration 40 --seed " + std::to_string(seed) +
           " --model " + name + "_truth.toml --gains " +
           source_path("controller/gains/crazyflie-small.toml") + " -o " + name);
  }
  /// The nominal model, with the lag that everyone knows of.
  std::string known_model() {
    write_text(folder_ / "known.toml", nominal_ + "\n" + kLag);
    return "known.toml";
  }
  files::Json run(const std::string& command, const std::string& schema) {
    demand("swarmcert " + command + " -q --force --json result.json");
    return files::read_json(folder_ / "result.json", "swarmcert/" + schema + "/1");
  }
  void demand(const std::string& command) {
    const Outcome outcome = run_shell(command, folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.output;
  }

 private:
  const ScratchFolder& folder_;
  std::string nominal_;
};

double total_rmse(const files::Json& comparison) {
  return comparison["overall"]["rmse"]["total"].get<double>();
}

TEST(HiddenEffect, IsNamedFirstAndTheErrorFallsOnceItIsAdded) {
  const ScratchFolder folder;
  Loop loop(folder);
  const std::string model = loop.known_model();
  for (const Truth& truth : truths()) {
    SCOPED_TRACE(truth.name);
    loop.fly("flights", truth.effects, 1);
    const files::Json diagnosis = loop.run("diagnose " + model + " flights", "diagnose");
    EXPECT_EQ(diagnosis["verdict"], "missing_effect");
    ASSERT_FALSE(diagnosis["ranking"].empty());
    if (!truth.other_form) {
      EXPECT_EQ(diagnosis["ranking"].size(), 1u) << diagnosis["ranking"].dump(1);
    }
    EXPECT_EQ(truth.answers.count(diagnosis["ranking"][0]["effect"].get<std::string>()), 1u)
        << diagnosis["ranking"][0].dump(1);
    const double before = total_rmse(loop.run("compare " + model + " flights", "compare"));
    const files::Json ladder =
        loop.run("add auto --model " + model + " flights -o better.toml", "add")["ladder"];
    ASSERT_GE(ladder.size(), 2u);
    const double after = total_rmse(loop.run("compare better.toml flights", "compare"));
    EXPECT_LT(after, 0.95 * before);
    EXPECT_NEAR(after, ladder.back()["test_rmse"].get<double>(), 1e-6 * after);
    std::filesystem::remove_all(folder.path() / "flights");
  }
}

TEST(HiddenEffect, NothingIsNamedWhereNothingIsHidden) {
  const ScratchFolder folder;
  Loop loop(folder);
  const std::string model = loop.known_model();
  for (const int seed : {1, 2}) {
    loop.fly("flights", "", seed);
    const files::Json diagnosis = loop.run("diagnose " + model + " flights", "diagnose");
    EXPECT_EQ(diagnosis["verdict"], "nothing_missing") << diagnosis["ranking"].dump(1);
    EXPECT_FALSE(diagnosis["unexplained"]["flag"].get<bool>());
    EXPECT_GT(diagnosis["detectable"].size(), 10u);
    std::filesystem::remove_all(folder.path() / "flights");
  }
}

TEST(HiddenEffect, SizesOfTheSameFormAreFoundWithinATenth) {
  const ScratchFolder folder;
  Loop loop(folder);
  const std::string model = loop.known_model();
  struct Case {
    const char *effect, *parameter;
    double value;
  };
  for (const Case& c : {Case{"thrust_ratio", "ratio", -0.08}, Case{"drag_linear", "drag_N_s_m", 0.02},
                        Case{"downwash", "amplitude_N", 0.0884}}) {
    loop.fly("flights",
             std::string("[[effect]]\nname = \"") + c.effect + "\"\nparameters = { " + c.parameter + " = " +
                 std::to_string(c.value) + " }\n",
             2);
    const files::Json diagnosis = loop.run("diagnose " + model + " flights", "diagnose");
    ASSERT_FALSE(diagnosis["ranking"].empty()) << c.effect;
    ASSERT_EQ(diagnosis["ranking"][0]["effect"], c.effect);
    EXPECT_NEAR(diagnosis["ranking"][0]["parameters"][c.parameter]["value"].get<double>(), c.value,
                0.1 * std::abs(c.value))
        << c.effect;
    std::filesystem::remove_all(folder.path() / "flights");
  }
}

TEST(HiddenEffect, AForceOutsideTheLibraryIsSaidToBeUnexplained) {
  const ScratchFolder folder;
  Loop loop(folder);
  const std::string model = loop.known_model();
  loop.fly("flights", expression("foreign", "force_z_N = \"a * sin(9 * x) * cos(7 * y)\"", "a = 0.05", "a"),
           1);
  const files::Json diagnosis = loop.run("diagnose " + model + " flights", "diagnose");
  EXPECT_TRUE(diagnosis["unexplained"]["flag"].get<bool>()) << diagnosis["unexplained"].dump();
}

TEST(HiddenEffect, WhatDoesNotHelpIsRefusedUnlessKeptAnyway) {
  const ScratchFolder folder;
  Loop loop(folder);
  const std::string model = loop.known_model();
  loop.fly("flights", "", 1);
  const std::string add = "add inflow --model " + model + " flights -o new.toml";
  EXPECT_FALSE(loop.run(add, "add")["ladder"][1]["accepted"].get<bool>());
  EXPECT_FALSE(std::filesystem::exists(folder / "new.toml"));
  EXPECT_TRUE(loop.run(add + " --keep-anyway", "add")["ladder"][1]["accepted"].get<bool>());
  EXPECT_NE(read_text(folder / "new.toml").find("inflow"), std::string::npos);
}

TEST(HiddenEffect, CampaignOfSeeds_slow) {
  const ScratchFolder folder;
  Loop loop(folder);
  const std::string model = loop.known_model();
  int runs = 0, first = 0, exact = 0;
  for (const Truth& truth : truths()) {
    for (int seed = 10; seed < 14; ++seed) {
      loop.fly("flights", truth.effects, seed);
      const files::Json ranking = loop.run("diagnose " + model + " flights", "diagnose")["ranking"];
      ++runs;
      const bool right =
          !ranking.empty() && truth.answers.count(ranking[0]["effect"].get<std::string>()) == 1;
      first += right ? 1 : 0;
      exact += right && (truth.other_form || ranking.size() == 1) ? 1 : 0;
      std::filesystem::remove_all(folder.path() / "flights");
    }
  }
  EXPECT_GE(first, 0.9 * runs);
  EXPECT_GE(exact, 0.85 * runs);
}

}  // namespace
}  // namespace swarmcert::tests

/// A motor lag beside a thrust scale: the thrust of the motors is scaled after the lag.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <string>

#include "analysis/run.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

constexpr double kScaledLag_s = 0.07, kFactor = 0.72;

/// Simulates two flights of motors that give 0.72 of the modelled thrust, with a lag.
void fly_worn_motors(const std::string& folder) {
  Truth truth;
  truth.thrust_factor = kFactor;
  truth.motor_lag_s = kScaledLag_s;
  for (int run = 0; run < 2; ++run)
    fly(truth, {Program::kRich, 1, 40, static_cast<std::uint64_t>(900 + run)}, folder, run);
}

/// The 90 % intervals contain both values; a lag of the modelled thrust would be 0.72 of 70 ms.
void expect_both(const files::Json& effects) {
  int seen = 0;
  for (const files::Json& entry : effects) {
    const bool is_lag = entry["effect"] == "motor_lag";
    if (!is_lag && entry["effect"] != "thrust_ratio") continue;
    ++seen;
    const files::Json& fitted = entry["parameters"][is_lag ? "tau_s" : "ratio"];
    const double truth = is_lag ? kScaledLag_s : kFactor;
    EXPECT_LE(fitted["interval_90"][0].get<double>(), truth) << entry.dump(1);
    EXPECT_GE(fitted["interval_90"][1].get<double>(), truth) << entry.dump(1);
    EXPECT_NEAR(fitted["value"].get<double>(), truth, is_lag ? 0.007 : 0.015);
  }
  EXPECT_EQ(seen, 2) << effects.dump(1);
}

TEST(ScaledLag, IsFittedWithTheScaleBesideIt) {
  const ScratchFolder folder;
  fly_worn_motors(folder / "flights");
  const Outcome outcome =
      run_shell("swarmcert diagnose " + source_path("stability/models/crazyflie-small.toml") +
                    " flights -q --json result.json",
                folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  expect_both(files::read_json(folder / "result.json", "swarmcert/diagnose/1")["ranking"]);
}

/// The model's own ratio acts on the thrust after the lag, like a fitted one.
TEST(ScaledLag, IsFittedBehindTheModelsOwnScale) {
  const ScratchFolder folder;
  fly_worn_motors(folder / "flights");
  write_text(
      folder / "model.toml",
      read_text(source_path("stability/models/crazyflie-small.toml")) +
          fmt::format("\n[[effect]]\nname = \"thrust_ratio\"\nparameters = {{ ratio = {} }}\n", kFactor - 1));
  const Outcome outcome = run_shell(
      "swarmcert add motor_lag --model model.toml flights -q -o new.toml --json result.json", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json result = files::read_json(folder / "result.json", "swarmcert/add/1");
  for (const files::Json& entry : result["effects"]) {
    if (entry["effect"] != "motor_lag") continue;
    EXPECT_NEAR(entry["parameters"]["tau_s"]["value"].get<double>(), kScaledLag_s, 0.007) << entry.dump(1);
    EXPECT_TRUE(result["ladder"][1]["accepted"].get<bool>());
    return;
  }
  ADD_FAILURE() << result.dump(1);
}

}  // namespace
}  // namespace swarmcert::tests

/// Hidden effects of larger vehicles, with packs of several cells.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "analysis/run.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

/// Returns what diagnose says about two flights of 40 s.
files::Json diagnosis_of(const Truth& truth, FlightPlan plan) {
  const ScratchFolder folder;
  const std::string flights = (folder.path() / "flights").string();
  for (int run = 0; run < 2; ++run, ++plan.seed) fly(truth, plan, flights, run);
  write_text((folder.path() / "model.toml").string(), model_of(plan.craft));
  const Outcome outcome =
      run_shell("swarmcert diagnose model.toml flights -q --force --json result.json", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  return files::read_json((folder.path() / "result.json").string(), "swarmcert/diagnose/1");
}

std::vector<std::string> names_of(const files::Json& diagnosis) {
  std::vector<std::string> names;
  for (const files::Json& entry : diagnosis["ranking"]) names.push_back(entry["effect"]);
  return names;
}

FlightPlan plan_of(const Craft& craft, std::uint64_t seed) {
  FlightPlan plan;
  plan.seed = seed;
  plan.craft = craft;
  return plan;
}

TEST(HiddenEffect, OfTheBatteryHasNoSecondNameWithSeveralCells) {
  for (const Craft& craft : {Craft{0.034, 1}, Craft{0.25, 2}, Craft{1.5, 3}, Craft{3, 4}}) {
    for (const std::uint64_t seed : {1, 21}) {
      SCOPED_TRACE(fmt::format("{} cells, seed {}", craft.cells, seed));
      Truth truth;
      truth.battery_1_V = 0.25 / craft.cells;
      const files::Json diagnosis = diagnosis_of(truth, plan_of(craft, seed));
      ASSERT_EQ(names_of(diagnosis), std::vector<std::string>{"battery"}) << diagnosis["ranking"].dump(1);
      const files::Json& values = diagnosis["ranking"][0]["parameters"];
      EXPECT_DOUBLE_EQ(values["full_V"]["value"].get<double>(), 4.2 * craft.cells);
      EXPECT_NEAR(values["sensitivity_1_V"]["value"].get<double>(), truth.battery_1_V,
                  0.1 * truth.battery_1_V);
    }
  }
}

}  // namespace
}  // namespace swarmcert::tests

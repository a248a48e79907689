/// Hidden effects of larger vehicles, with packs of several cells.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
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

/// Expects that one effect is named, with these values to a tenth, and that nothing is left.
void expect_only(const std::string& effect, const std::map<std::string, double>& values,
                 const files::Json& diagnosis) {
  ASSERT_EQ(names_of(diagnosis), std::vector<std::string>{effect}) << diagnosis["ranking"].dump(1);
  EXPECT_TRUE(diagnosis["remainder"].empty()) << diagnosis["remainder"].dump(1);
  for (const auto& [name, value] : values) {
    EXPECT_NEAR(diagnosis["ranking"][0]["parameters"][name]["value"].get<double>(), value,
                0.1 * std::abs(value))
        << name;
  }
}

Truth truth_of(std::function<Eigen::Vector3d(const Moment&)> force_N) {
  Truth truth;
  truth.force_N = std::move(force_N);
  return truth;
}

constexpr Craft kLarge = {2.6, 6};

TEST(HiddenEffect, OfWindOnALargeVehicleIsFoundAsLargeAsItIs) {
  const Truth wind = truth_of([](const Moment&) { return Eigen::Vector3d(-15.6, 0, 0); });
  expect_only("constant_force", {{"force_x_N", -15.6}}, diagnosis_of(wind, plan_of(kLarge, 1)));
}

TEST(HiddenEffect, OfTwiceTheThrustIsFoundAsLargeAsItIs) {
  Truth strong;
  strong.thrust_factor = 2.2;
  expect_only("thrust_ratio", {{"ratio", 2.2}}, diagnosis_of(strong, plan_of({1.5, 3}, 1)));
}

TEST(HiddenEffect, OfADroppedLoadOnALargeVehicleIsFoundAsLargeAsItIs) {
  const Truth drop =
      truth_of([](const Moment& now) { return Eigen::Vector3d(0, 0, now.time_s < 20 ? -0.6 * 9.81 : 0); });
  expect_only("payload_step", {{"mass_before_kg", 0.6}}, diagnosis_of(drop, plan_of(kLarge, 1)));
}

TEST(HiddenEffect, ThatEndsAtItsBoundIsNotIdentified) {
  // No rotor loses 60 % of its thrust per metre per second of climb.
  const Truth loss = truth_of([](const Moment& now) {
    return Eigen::Vector3d(-0.6 * now.thrust_N * now.b3.dot(now.v_m_s) * now.b3);
  });
  const files::Json diagnosis = diagnosis_of(loss, plan_of({}, 1));
  const std::vector<std::string> names = names_of(diagnosis);
  EXPECT_EQ(std::count(names.begin(), names.end(), "inflow"), 0);
  EXPECT_EQ(diagnosis["kinds"][0]["at_bound"], std::vector<std::string>{"inflow"})
      << diagnosis["kinds"].dump(1);
  EXPECT_FALSE(diagnosis["remainder"].empty());
}

TEST(HiddenEffect, IsFoundInTenRecordsPerSecond) {
  FlightPlan plan = plan_of({}, 1);
  plan.duration_s = 90;
  plan.log_hz = 10;
  Truth truth;
  truth.thrust_factor = 1.08;
  expect_only("thrust_ratio", {{"ratio", 1.08}}, diagnosis_of(truth, plan));
  const Truth drag = truth_of([](const Moment& now) { return Eigen::Vector3d(-0.03 * now.v_m_s); });
  expect_only("drag_linear", {{"drag_N_s_m", 0.03}}, diagnosis_of(drag, plan));
  const files::Json nothing = diagnosis_of({}, plan);
  EXPECT_EQ(nothing["verdict"], "nothing_missing") << nothing.dump(1);
  EXPECT_TRUE(nothing["remainder"].empty());
}

}  // namespace
}  // namespace swarmcert::tests

/// Effects of the registry suggested by a scan, hidden in flights of the foreign simulator: diagnose reports them, and
/// their true values are within the intervals.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "analysis/run.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

using Eigen::Vector3d;

constexpr double kWeight_N = 0.034 * 9.81, kRotorLag_s = 0.06;

/// The hidden effect and its values that are observable in these flights.
struct NamedTruth {
  std::string effect;
  std::function<Vector3d(const Moment&)> force_N;
  std::vector<std::pair<std::string, double>> values;
};

double speed_across(const Moment& now) { return (now.v_m_s - now.b3 * now.b3.dot(now.v_m_s)).norm(); }

std::vector<NamedTruth> named_truths() {
  return {
      {"payload_step",
       [](const Moment& now) { return Vector3d(0, 0, now.time_s < 14 ? -9.81 * 0.004 : 0); },
       {{"mass_before_kg", 0.004}, {"mass_after_kg", 0}}},
      {"translational_lift",
       [](const Moment& now) {
         const double u = speed_across(now) / 0.4;
         return Vector3d(0.12 * now.thrust_N * (1 - std::exp(-u * u)) * now.b3);
       },
       {{"gain", 0.12}, {"speed_m_s", 0.4}}},
      {"wind_field",
       [](const Moment& now) {
         const double x = now.p_m.x() - 0.2, y = now.p_m.y() + 0.1;
         return Vector3d(0, 0, 0.03 * std::exp(-(x * x + y * y) / (2 * 0.2 * 0.2)));
       },
       {{"thermal_N", 0.03}, {"radius_m", 0.2}}},
      {"wind_field",
       [](const Moment& now) {
         return Vector3d(Vector3d(0.03, -0.015, 0) / (1 + std::exp(-(now.p_m.z() - 0.6) / 0.08)));
       },
       {{"shear_x_N", 0.03}, {"height_m", 0.6}}},
      {"wall",
       [](const Moment& now) {
         return Vector3d(-0.1 * now.thrust_N * std::exp(-std::max(0.6 - now.p_m.x(), 0.0) / 0.15), 0, 0);
       },
       {{"decay_m", 0.15}}},
      {"vortex_ring",
       [](const Moment& now) {
         const double u = (now.b3.dot(now.v_m_s) + 0.4) / 0.12;
         return Vector3d(-0.12 * now.thrust_N * std::exp(-u * u / 2) * now.b3);
       },
       {{"loss", 0.12}, {"descent_m_s", 0.4}}},
      {"voltage_sag",
       [](const Moment& now) {
         const double load = now.thrust_N / kWeight_N;
         return Vector3d(-0.2 * now.thrust_N * (load * std::sqrt(load) - 1) * now.b3);
       },
       {{"sag", 0.2}}},
      {"thrust_saturation",
       [](const Moment& now) {
         return Vector3d(-0.8 * std::max(now.thrust_N - 1.08 * kWeight_N, 0.0) * now.b3);
       },
       {{"loss", 0.8}, {"knee_weights", 1.08}}},
  };
}

class NamedForm : public testing::TestWithParam<std::size_t> {};

TEST_P(NamedForm, IsNamedAloneWithItsValuesInTheirIntervals) {
  const NamedTruth hidden = named_truths()[GetParam()];
  SCOPED_TRACE(hidden.effect);
  const ScratchFolder folder;
  write_text(
      folder / "model.toml",
      read_text(source_path("stability/models/crazyflie-small.toml")) +
          fmt::format("\n[[effect]]\nname = \"motor_lag\"\nparameters = {{ tau_s = {} }}\n", kRotorLag_s));
  Truth truth;
  truth.motor_lag_s = kRotorLag_s;
  truth.force_N = hidden.force_N;
  for (int run = 0; run < 3; ++run)
    fly(truth, {Program::kRich, 1, 40, static_cast<std::uint64_t>(300 + run)}, folder / "flights", run);
  const Outcome outcome =
      run_shell("swarmcert diagnose model.toml flights -q --json result.json", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json result = files::read_json(folder / "result.json", "swarmcert/diagnose/1");
  ASSERT_EQ(result["ranking"].size(), 1u) << result["ranking"].dump(1) << result["remainder"].dump(1);
  const files::Json& named = result["ranking"][0];
  EXPECT_EQ(named["effect"], hidden.effect);
  for (const auto& [parameter, value] : hidden.values) {
    const files::Json& fitted = named["parameters"][parameter];
    ASSERT_TRUE(fitted.contains("interval_90")) << parameter << named.dump(1);
    // One of eight 90 % intervals is expected to miss, so 99 % intervals are used.
    const double lower = fitted["interval_90"][0], upper = fitted["interval_90"][1];
    const double more = 0.5 * (upper - lower) * (2.576 / 1.645 - 1);
    EXPECT_LE(lower - more, value) << parameter;
    EXPECT_GE(upper + more, value) << parameter;
    EXPECT_NEAR(fitted["value"].get<double>(), value, std::max(0.2 * std::abs(value), 3e-4)) << parameter;
  }
}

INSTANTIATE_TEST_SUITE_P(OfTheRegistry, NamedForm, testing::Range<std::size_t>(0, named_truths().size()));

}  // namespace
}  // namespace swarmcert::tests

/// diagnose --against and --each on flights of the foreign simulator.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "analysis/run.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

constexpr double kDrag_N_s_m = 0.02, kLag_s = 0.06, kFleetFlight_s = 30;

class FlightsOfAFleet : public testing::Test {
 protected:
  /// Simulates `folder`/cf1_<run> with `factor` times the model's thrust, drag and a lag.
  void fly_at(const std::string& folder, int run, double factor, double drag = kDrag_N_s_m,
              double duration_s = kFleetFlight_s) {
    Truth truth;
    truth.thrust_factor = factor;
    truth.motor_lag_s = kLag_s;
    truth.force_N = [drag](const Moment& now) { return Eigen::Vector3d(-drag * now.v_m_s); };
    fly(truth, {Program::kRich, 1, duration_s, static_cast<std::uint64_t>(700 + run)}, folder_ / folder, run);
  }

  Outcome diagnose(const std::string& words) {
    return run_shell(
        "swarmcert diagnose " + source_path("stability/models/crazyflie-small.toml") + " " + words,
        folder_.path());
  }
  files::Json result(const std::string& words) {
    const Outcome outcome = diagnose(words + " -q --force --json result.json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return files::read_json(folder_ / "result.json", "swarmcert/diagnose/1");
  }

  const ScratchFolder folder_;
};

TEST_F(FlightsOfAFleet, AgainstHealthyFlightsShowOnlyWhatChanged) {
  const double healthy[] = {0.945, 0.95, 0.955};
  for (int run = 0; run < 3; ++run) fly_at("healthy", run, healthy[run]);
  for (int run = 3; run < 5; ++run) fly_at("worn", run, 0.88);
  const files::Json alone = result("worn");
  EXPECT_GE(alone["ranking"].size(), 3u) << "ratio, drag and lag are not in the model";
  const files::Json json = result("worn --against healthy");
  EXPECT_EQ(json["verdict"], "missing_effect");
  ASSERT_EQ(json["ranking"].size(), 1u) << json["ranking"].dump(1);
  const files::Json& change = json["ranking"][0];
  EXPECT_EQ(change["effect"], "thrust_ratio");
  EXPECT_EQ(change["vehicle"], "cf1");
  const files::Json& interval = change["parameters"]["ratio"]["interval_90"];
  const double change_of_ratio = 1 + (0.88 - 0.95);  // as a factor of the thrust commanded by the model
  EXPECT_LE(interval[0].get<double>(), change_of_ratio);
  EXPECT_GE(interval[1].get<double>(), change_of_ratio);
  const files::Json& vehicle = json["against"]["vehicles"][0];
  EXPECT_TRUE(vehicle["same_vehicle"].get<bool>());
  EXPECT_EQ(vehicle["other_groups"], 3);
  EXPECT_EQ(vehicle["grouped_by"], "flight");
  EXPECT_EQ(vehicle["held"].size(), 3u) << vehicle["held"].dump(1);
}

TEST_F(FlightsOfAFleet, AChangeWithinTheScatterOfDaysIsNone) {
  // Pooled, these days look like a force that falls with the thrust, which none of them shows separately.
  const double days[] = {0.9, 0.95, 1.0};
  for (int run = 0; run < 3; ++run) fly_at(fmt::format("day_{}", run), run, days[run]);
  fly_at("today", 3, 0.92);
  const files::Json json = result("today --against day_0 day_1 day_2");
  EXPECT_TRUE(json["ranking"].empty()) << json["ranking"].dump(1);
  const files::Json& vehicle = json["against"]["vehicles"][0];
  EXPECT_EQ(vehicle["grouped_by"], "folder");
  EXPECT_EQ(vehicle["other_groups"], 3);
  for (const files::Json& held : vehicle["held"])
    EXPECT_EQ(held["effect"].get<std::string>().find("formula"), std::string::npos) << held.dump(1);
}

TEST_F(FlightsOfAFleet, AgainstFlightsThatAreTooShortNothingIsSaid) {
  fly_at("flights", 0, 0.9);
  fly_at("short", 1, 1, kDrag_N_s_m, 8);
  const Outcome outcome = diagnose("flights --against short -q --json result.json");
  EXPECT_EQ(outcome.exit_code, 4) << outcome.output;
  const files::Json json = files::read_json(folder_ / "result.json", "swarmcert/diagnose/1");
  EXPECT_EQ(json["verdict"], "inconclusive");
  EXPECT_TRUE(json["ranking"].empty());
  EXPECT_NE(json["reason"].get<std::string>().find("of the other flights"), std::string::npos);
}

TEST_F(FlightsOfAFleet, AFlightIsNotHeldAgainstItself) {
  fly_at("flights", 0, 1);
  const Outcome outcome = diagnose("flights --against flights/cf1_00");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.output.find("both sides"), std::string::npos) << outcome.output;
}

TEST_F(FlightsOfAFleet, EachFlightHasItsNumbersWithDriftAndOutlier) {
  constexpr int kFlights = 7, kOdd = 3;
  std::vector<double> factors;
  for (int run = 0; run < kFlights; ++run) factors.push_back(0.95 + 0.005 * run);
  factors[kOdd] = 0.85;
  for (int run = 0; run < kFlights; ++run) fly_at("flights", run, factors[static_cast<std::size_t>(run)]);
  const files::Json json = result("flights --each --next --report page");
  ASSERT_EQ(json["each"].size(), static_cast<std::size_t>(kFlights));
  for (int run = 0; run < kFlights; ++run) {
    SCOPED_TRACE(run);
    const files::Json& row = json["each"][static_cast<std::size_t>(run)];
    ASSERT_FALSE(row["thrust_ratio"].is_null()) << row.dump(1);
    ASSERT_FALSE(row["drag_N_s_m"].is_null()) << row.dump(1);
    ASSERT_FALSE(row["lag_s"].is_null()) << row.dump(1);
    EXPECT_NEAR(row["thrust_ratio"]["value"].get<double>(), factors[static_cast<std::size_t>(run)], 0.01);
    EXPECT_NEAR(row["drag_N_s_m"]["value"].get<double>(), kDrag_N_s_m, 0.1 * kDrag_N_s_m);
    EXPECT_NEAR(row["lag_s"]["value"].get<double>(), kLag_s, 0.15 * kLag_s);
    EXPECT_EQ(row["outlier"].empty(), run != kOdd) << row.dump(1);
  }
  ASSERT_EQ(json["each_days"].size(), 1u);
  EXPECT_EQ(json["each_days"][0]["flights"], kFlights);
  bool drifts = false;
  for (const files::Json& drift : json["each_drifts"]) {
    EXPECT_EQ(drift["drifts"].get<bool>(), drift["number"] == "thrust_ratio") << drift.dump(1);
    if (drift["number"] != "thrust_ratio") continue;
    drifts = true;
    EXPECT_NEAR(drift["per_flight"].get<double>(), 0.005, 0.001);
  }
  EXPECT_TRUE(drifts);
  EXPECT_TRUE(json["next"].is_array());
  EXPECT_TRUE(std::filesystem::exists(folder_ / "page/each_1_1.dat"));
}

}  // namespace
}  // namespace swarmcert::tests

// bound --tube --task as a user runs it.
#include <gtest/gtest.h>

#include <array>
#include <sstream>

#include "analysis/run.h"
#include "nn/base/json.h"
#include "nn/base/random.h"

namespace swarmcert::tests {
namespace {

using files::Json;

const std::string kSources = SWARMCERT_SOURCE_DIR;
const std::string kNetwork = " --network " + kSources + "/nn/networks/demo/network.toml";
const std::string kTruth = " --truth " + kSources + "/stability/models/crazyflie-small-effects.toml";

/// The model of kTruth with motors that respond at once, as in composite.toml, written to `folder`.
std::string truth_without_lag(const ScratchFolder& folder) {
  std::string text = read_text(kSources + "/stability/models/crazyflie-small-effects.toml");
  const std::size_t lag = text.find("[[effect]]\nname = \"motor_lag\"");
  text.erase(lag, text.find("[[effect]]", lag + 1) - lag);
  write_text(folder / "truth.toml", text);
  return " --truth truth.toml";
}

std::string bound(const std::string& gains) {
  return "swarmcert bound --gains " + kSources + "/controller/gains/" + gains + " --model " + kSources +
         "/stability/models/crazyflie-small.toml";
}

TEST(TubeCommand, ProvesATubeAroundASwapAndReportsIt) {
  const ScratchFolder folder;
  const std::string command = bound("composite.toml") + kNetwork + truth_without_lag(folder) +
                              " --tube --task swap --duration 4.5 --report r";
  ASSERT_EQ(run_shell(command + " --json a.json", folder.path()).exit_code, 0);
  const Json result = files::parse_json(read_text(folder / "a.json"), "a.json");
  EXPECT_TRUE(result["tube"].is_array()) << "the bound over time stays where it was";
  const Json& tube = result["local_tube"];
  EXPECT_EQ(tube["verdict"], "proved");
  EXPECT_EQ(tube["task"], "swap");
  EXPECT_EQ(tube["vehicles"], 2);
  EXPECT_EQ(tube["duration_s"], 4.5);
  EXPECT_FALSE(tube["interrupted"].get<bool>());
  const double radius_m = tube["radius_m"].get<double>();
  EXPECT_GT(radius_m, 0);
  for (const Json& r : tube["radius_xyz_m"]) EXPECT_LE(r.get<double>(), radius_m);
  ASSERT_EQ(tube["radii"].size(), 2u);
  for (const Json& r : tube["radii"]) EXPECT_GT(r["force_error_N"].get<double>(), 0);
  for (const Json& at : tube["at"])
    for (const Json& e : at["error_z_m"]) EXPECT_LE(e.get<double>(), tube["radius_xyz_m"][2].get<double>());
  ASSERT_EQ(tube["slices"].size(), tube["at"].size());
  for (std::size_t n = 0; n < tube["slices"].size(); ++n) {
    const Json& vehicles = tube["slices"][n]["error_xyz_m"];
    ASSERT_EQ(vehicles.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double low = vehicles[i][k][0].get<double>();
        const double high = vehicles[i][k][1].get<double>();
        EXPECT_LE(low, high);
        EXPECT_LE(std::max(-low, high), tube["radii"][i]["position_m"][k].get<double>());
      }
    }
  }
  EXPECT_NE(read_text(folder / "r/report.html").find("Tube around the task"), std::string::npos);
  std::istringstream data(read_text(folder / "r/local_tube.dat"));
  std::string line;
  int rows = 0;
  while (std::getline(data, line)) ++rows;
  EXPECT_GT(rows, 100);
}

TEST(TubeCommand, ProvesTheGainsThatFlewAndThreeVehicles) {
  const ScratchFolder folder;
  for (const char* const arguments : {"crazyflie-small.toml", "composite.toml --vehicles 3"}) {
    const std::string all = arguments;
    const std::size_t end = all.find(' ');
    const std::string rest = end == std::string::npos ? "" : all.substr(end);
    const Outcome outcome = run_shell(bound(all.substr(0, end)) + rest + kNetwork + kTruth +
                                          " --tube --task swap --duration 4.5 --json out.json --force",
                                      folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    const Json tube = files::parse_json(read_text(folder / "out.json"), "out.json")["local_tube"];
    EXPECT_EQ(tube["verdict"], "proved") << all;
    // composite.toml states no rate.
    EXPECT_EQ(tube["loop"], rest.empty() ? "sampled" : "continuous");
    EXPECT_LT(tube["radius_m"].get<double>(), 0.1);
    EXPECT_FALSE(tube["slices"].empty());
  }
}

TEST(TubeCommand, AnIntervalOfLagsWidensTheTubeAndContainsTheTruthsLag) {
  const ScratchFolder folder;
  const std::string command = bound("crazyflie-small.toml") + kNetwork + kTruth +
                              " --tube --task swap --duration 4.5 --quiet --force --json a.json";
  double radius_z_m[2];
  for (const bool is_interval : {false, true}) {
    ASSERT_EQ(
        run_shell(command + (is_interval ? " --lag-interval 0.052 0.063" : ""), folder.path()).exit_code, 0);
    const Json tube = files::parse_json(read_text(folder / "a.json"), "a.json")["local_tube"];
    EXPECT_EQ(tube["verdict"], "proved");
    EXPECT_EQ(tube["loop"], "sampled");
    EXPECT_NEAR(tube["motor_lag_s"][0].get<double>(), is_interval ? 0.052 : 1 / 17.4, 1e-12);
    EXPECT_NEAR(tube["motor_lag_s"][1].get<double>(), is_interval ? 0.063 : 1 / 17.4, 1e-12);
    radius_z_m[is_interval ? 1 : 0] = tube["radius_xyz_m"][2].get<double>();
  }
  EXPECT_GT(radius_z_m[1], 1.01 * radius_z_m[0]);
  EXPECT_LT(radius_z_m[1], 1.12 * radius_z_m[0]);
  const auto refused = [&](const std::string& interval, const std::string& why) {
    const auto run = run_shell(command + " --lag-interval " + interval, folder.path());
    EXPECT_EQ(run.exit_code, 2) << interval;
    EXPECT_NE(run.output.find(why), std::string::npos) << run.output;
  };
  refused("0.06 0.07", "tau_s = 0.05747");
  refused("0 0.06", "above 0");
  refused("52 63", "in seconds");
  refused("0.063 0.052", "the least and the largest");
}

/// Simulates the swap `count` times in `folder`/`name`, with an individual drag and constant force per flight.
/// @returns the largest error of each flight, x, y, z.
std::vector<std::array<double, 3>> fly_swaps(const ScratchFolder& folder, const std::string& name, int first,
                                             int count) {
  files::Random random(static_cast<std::uint64_t>(first));
  const std::string model = read_text(kSources + "/stability/models/crazyflie-small-effects.toml");
  std::vector<std::array<double, 3>> largest;
  for (int i = first; i < first + count; ++i) {
    std::string text = model;
    const std::string drag = "drag_N_s_m = 0.013";
    text.replace(text.find(drag), drag.size(),
                 "drag_N_s_m = " + std::to_string(0.013 + 0.004 * random.symmetric()));
    text +=
        "\n[[effect]]\nname = \"constant_force\"\nparameters = { force_x_N = 0, force_y_N = 0, force_z_N = " +
        std::to_string(0.001 * random.bell()) + " }\n";
    write_text(folder / "flown.toml", text);
    const std::string run = std::to_string(i);
    const auto flown =
        run_shell("swarmcert simulate swap --vehicles 2 --duration 3 --model flown.toml --gains " + kSources +
                      "/controller/gains/composite.toml" + kNetwork + " --quiet --seed " + run + " --run " +
                      run + " --json f.json --force -o " + name + "/" + run,
                  folder.path());
    EXPECT_EQ(flown.exit_code, 0) << flown.output;
    std::array<double, 3> most{};
    const Json result = files::parse_json(read_text(folder / "f.json"), "f.json");
    for (const Json& vehicle : result["vehicles"]) {
      const char* const axes[] = {"x", "y", "z"};
      for (std::size_t k = 0; k < 3; ++k) most[k] = std::max(most[k], vehicle["max"][axes[k]].get<double>());
    }
    largest.push_back(most);
  }
  return largest;
}

TEST(TubeCommand, ATruthThatFlightsMeasuredKeepsFurtherFlightsInItsTube) {
  const ScratchFolder folder;
  fly_swaps(folder, "calibrate", 1, 21);
  ASSERT_EQ(
      run_shell("swarmcert compare " + kTruth.substr(9) + " calibrate --quiet --json c.json", folder.path())
          .exit_code,
      0);
  const std::string command = bound("composite.toml") + kNetwork + kTruth +
                              " --tube --task swap --duration 3 --quiet --force --json out.json";
  const Outcome outcome = run_shell(command + " --from c.json --coverage 0.9", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const Json tube = files::parse_json(read_text(folder / "out.json"), "out.json")["local_tube"];
  EXPECT_EQ(tube["verdict"], "proved");
  const Json& measured = tube["measured"];
  EXPECT_EQ(measured["flights"], 14);
  EXPECT_EQ(measured["shape_flights"], 7);
  EXPECT_LT(measured["interval"][0].get<double>(), 0.9);
  EXPECT_GT(measured["interval"][1].get<double>(), 0.9);
  EXPECT_GT(measured["cells_in_tube"].get<int>(), measured["cells_in_tube_without_flights"].get<int>());
  EXPECT_NE(outcome.output.find("use the hull of all cells"), std::string::npos);
  EXPECT_NE(outcome.output.find("rests on: forces are means over 0.1 s"), std::string::npos);
  int inside = 0;
  double largest_m = 0;
  for (const std::array<double, 3>& most : fly_swaps(folder, "further", 1001, 30)) {
    bool is_inside = true;
    for (std::size_t k = 0; k < 3; ++k)
      is_inside = is_inside && most[k] <= tube["radius_xyz_m"][k].get<double>();
    inside += is_inside ? 1 : 0;
    largest_m = std::max(largest_m, most[2]);
  }
  EXPECT_GE(inside, 27);
  // The ranges include accelerometer noise as if it were a force: 0.12 m/s^2 of noise widens the tube to several
  // times that of the truth alone.
  EXPECT_LT(tube["radius_xyz_m"][2].get<double>(), 8 * largest_m);
}

TEST(TubeCommand, AMeasuredTruthIsThatOfTheModelThatWasCompared) {
  const ScratchFolder folder;
  fly_swaps(folder, "calibrate", 1, 2);
  const std::string compare = "swarmcert compare --quiet --force --json c.json calibrate ";
  ASSERT_EQ(run_shell(compare + kSources + "/stability/models/crazyflie-small.toml", folder.path()).exit_code,
            0);
  const std::string command = bound("composite.toml") + kNetwork +
                              " --tube --task swap --duration 2 --quiet --from c.json --coverage 0.9";
  const Outcome other = run_shell(command + kTruth, folder.path());
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_NE(other.output.find("residuals belong to another model"), std::string::npos) << other.output;
  EXPECT_EQ(run_shell(command, folder.path()).exit_code, 2) << "no --truth";
  const Outcome few =
      run_shell(command + " --truth " + kSources + "/stability/models/crazyflie-small.toml", folder.path());
  EXPECT_EQ(few.exit_code, 3);
  EXPECT_NE(few.output.find("needs at least 14"), std::string::npos) << few.output;
}

TEST(TubeCommand, ErrorsOfTheEstimatesAreInTheTubeAndInWhatItSays) {
  const ScratchFolder folder;
  const std::string command = bound("composite.toml") + kNetwork + kTruth +
                              " --tube --task swap --duration 2 --json out.json --force";
  double last_m = 0;
  for (const std::string errors :
       {"", " --velocity-error 0.01,0.01,0.02", " --velocity-error 0.02 --position-error 0.004"}) {
    ASSERT_EQ(run_shell(command + errors, folder.path()).exit_code, 0) << errors;
    const Json tube = files::parse_json(read_text(folder / "out.json"), "out.json")["local_tube"];
    EXPECT_EQ(tube["verdict"], "proved");
    EXPECT_GT(tube["radius_xyz_m"][2].get<double>(), last_m) << errors;
    last_m = tube["radius_xyz_m"][2].get<double>();
    EXPECT_EQ(tube["velocity_error_m_s"][2], errors.empty() ? 0 : 0.02);
    EXPECT_EQ(tube["position_error_m"][0], errors.find("position") == std::string::npos ? 0 : 0.004);
    const std::string name =
        errors.empty() ? "exact position and velocity" : "errors of the estimates stay within their bounds";
    int said = 0;
    for (const Json& a : tube["assumptions"]) said += a["name"] == name ? 1 : 0;
    EXPECT_EQ(said, 1) << errors;
  }
}

TEST(TubeCommand, TheResultDoesNotDependOnTheThreads) {
  const ScratchFolder folder;
  const std::string command =
      bound("composite.toml") + kNetwork + kTruth + " --tube --task swap --duration 2";
  for (const char* const jobs : {"1", "3"})
    ASSERT_EQ(run_shell(command + " --jobs " + jobs + " --json " + jobs, folder.path()).exit_code, 0);
  EXPECT_GT(read_text(folder / "1").size(), 1000u);
  EXPECT_EQ(read_text(folder / "1"), read_text(folder / "3"));
}

TEST(TubeCommand, WhatIsMissingOrMakesNoSenseIsSaid) {
  const ScratchFolder folder;
  const std::string all = bound("composite.toml") + " --tube --task swap";
  for (const auto& [command, words] : {
           std::pair(all + kNetwork, "--truth"),
           std::pair(all + kTruth, "--network"),
           std::pair(bound("composite.toml") + " --task swap" + kNetwork + kTruth, "--task requires --tube"),
           std::pair(bound("composite.toml") + " --tube --task swop" + kNetwork + kTruth, "swap"),
           std::pair(bound("composite.toml") + " --tube --task circle" + kNetwork + kTruth, "enclosure"),
           std::pair(all + kNetwork + kTruth + " --vehicles 1", "--vehicles"),
       }) {
    const Outcome outcome = run_shell(command, folder.path());
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_NE(outcome.output.find(words), std::string::npos) << outcome.output;
  }
  const Outcome no_file = run_shell(all + kNetwork + " --truth nowhere.toml", folder.path());
  EXPECT_EQ(no_file.exit_code, 3);
  EXPECT_NE(no_file.output.find("nowhere.toml"), std::string::npos) << no_file.output;
}

TEST(TubeCommand, WeightsThatAreNoNumberAreRefused) {
  const ScratchFolder folder;
  std::filesystem::copy(kSources + "/nn/networks/demo", folder.path() / "net");
  // The data of a safetensors file end with the last tensor; its last number becomes NaN.
  std::string bytes = read_text(folder / "net/phi.safetensors");
  bytes.replace(bytes.size() - 4, 4, std::string("\x00\x00\xc0\x7f", 4));
  write_text(folder / "net/phi.safetensors", bytes);
  const Outcome outcome = run_shell(
      bound("composite.toml") + " --tube --task swap --network net/network.toml" + kTruth, folder.path());
  EXPECT_EQ(outcome.exit_code, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("phi.safetensors"), std::string::npos) << outcome.output;
}

TEST(TubeCommand, WhereNothingIsProvedTheExitCodeAndTheReasonSaySo) {
  const ScratchFolder folder;
  write_text(folder / "weak.toml", "schema = \"swarmcert/gains/1\"\n[position]\nLambda = 0.1\nK = 0.005\n");
  const Outcome outcome = run_shell("swarmcert bound --gains weak.toml --model " + kSources +
                                        "/stability/models/crazyflie-small.toml" + kNetwork + kTruth +
                                        " --tube --task swap --duration 6 --json out.json",
                                    folder.path());
  EXPECT_EQ(outcome.exit_code, 4) << outcome.output;
  const Json tube = files::parse_json(read_text(folder / "out.json"), "out.json")["local_tube"];
  EXPECT_EQ(tube["verdict"], "inconclusive");
  EXPECT_TRUE(tube["radius_m"].is_null());
  EXPECT_NE(tube["why"].get<std::string>().find("errors could exceed 0.5 m"), std::string::npos);
  EXPECT_TRUE(tube["slices"].empty());
}

}  // namespace
}  // namespace swarmcert::tests

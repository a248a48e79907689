#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "analysis/log_writer.h"
#include "analysis/residuals/failing_place.h"
#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/velocity_error.h"
#include "analysis/run.h"
#include "data.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

using residuals::AccelerometerFilter;

double filtered(AccelerometerFilter& filter, double time_s, double value) {
  Eigen::Matrix3Xd values = Eigen::Matrix3Xd::Constant(3, 1, value);
  filter.advance(time_s, values);
  return values(0, 0);
}

TEST(AccelerometerFilter, DelaysARampByTheTwoPolesAndKeepsItsSlope) {
  // A second-order Butterworth low-pass delays slow signals by sqrt(2) / (2 pi cutoff).
  AccelerometerFilter filter(30, 1);
  const double delay_s = std::sqrt(2.0) / (2 * M_PI * 30);
  std::mt19937 random(1);
  double time_s = 0, output = filtered(filter, 0, 0);
  for (int i = 0; i < 200; ++i) {
    time_s += 0.008 + 0.004 * static_cast<double>(random()) / 4294967296.0;
    output = filtered(filter, time_s, 3 * time_s);
  }
  EXPECT_NEAR(output, 3 * (time_s - delay_s), 1e-9);
}

TEST(AccelerometerFilter, FiltersEveryAxisOfEveryChannelAsIfItWereAlone) {
  constexpr int kChannels = 5;
  AccelerometerFilter together(30, kChannels);
  std::vector<AccelerometerFilter> alone(3 * kChannels, AccelerometerFilter(30, 1));
  std::mt19937 random(1);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  double time_s = 0, filtered_away = 0;
  for (int i = 0; i < 50; ++i) {
    time_s += 0.002 + 0.016 * uniform();
    Eigen::Matrix3Xd values(3, kChannels);
    for (double& value : values.reshaped()) value = 2 * uniform() - 1;
    const Eigen::Matrix3Xd inputs = values;
    together.advance(time_s, values);
    for (int k = 0; k < 3 * kChannels; ++k) {
      const double expected = filtered(alone[static_cast<std::size_t>(k)], time_s, inputs(k % 3, k / 3));
      EXPECT_NEAR(values(k % 3, k / 3), expected, 1e-12);
    }
    filtered_away = std::max(filtered_away, (values - inputs).cwiseAbs().maxCoeff());
  }
  EXPECT_GT(filtered_away, 0.5);
}

TEST(VelocityError, IsWhatTheEstimatedVelocityHasMoreThanTheSlopeOfThePosition) {
  // x oscillates with 0.3 m at 3 rad/s, and its estimated velocity is 1.1 times too large; z is constant, and its
  // velocity is off by 0.05.
  residuals::Track track;
  double pause_s = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i == 1200) pause_s = 5;  // the vehicle is elsewhere afterwards
    stability::Instant now;
    now.time_s = 0.01 * i + pause_s;
    now.p_W_m = {0.3 * std::sin(3 * now.time_s) + pause_s, 0, 1};
    now.v_W_m_s = {1.1 * 0.9 * std::cos(3 * now.time_s), 0, 0.05};
    track.instants.push_back(now);
    const bool restarts = i == 0 || i == 1200;
    track.restarts.push_back(restarts ? 1 : 0);
    const bool settles = i < 20 || (i >= 1200 && i < 1220);
    track.cut.push_back(settles ? residuals::Cut::kSettling : residuals::Cut::kNone);
  }
  const std::vector<residuals::ErrorWindow> windows =
      residuals::error_windows(track, residuals::velocity_error(track));
  ASSERT_GE(windows.size(), 3u);
  for (const residuals::ErrorWindow& window : windows) {
    EXPECT_NEAR(window.amplitude[0], 0.09, 0.005);
    EXPECT_NEAR(window.rate[0], 0.27, 0.02);
    EXPECT_NEAR(window.amplitude[1], 0, 1e-9);
    EXPECT_NEAR(window.amplitude[2], 0.05, 1e-6);
  }
}

TEST(AccelerometerFilter, StepsOfAnyLengthGiveTheSameResponse) {
  AccelerometerFilter coarse(30, 1), fine(30, 1);
  filtered(coarse, 0, 0);
  filtered(fine, 0, 0);
  double output = 0;
  for (int k = 1; k <= 10; ++k) output = filtered(fine, 0.001 * k, 0.1 * k);
  EXPECT_NEAR(filtered(coarse, 0.01, 1), output, 1e-12);
}

TEST(FindFlights, GroupsVehiclesByFolderPrefixAndRun) {
  const ScratchFolder folder;
  for (const char* name : {"cf1_00", "cf2_00", "cf1_01", "day_cf1_00.csv", "cf1_01.csv", "notes.txt"})
    write_text(folder / name, "x");
  const residuals::FoundFlights found = residuals::find_flights({folder.path().string()});
  ASSERT_EQ(found.flights.size(), 3u);
  EXPECT_EQ(found.flights[0].logs.size(), 2u);
  EXPECT_EQ(found.flights[1].logs[0].second, folder / "cf1_01");
  EXPECT_EQ(found.flights[2].logs[0].first, "cf1");
  EXPECT_EQ(found.skipped.size(), 2u) << "the text, and the CSV beside a binary log";
  EXPECT_THROW(residuals::find_flights({folder / "nowhere"}), files::InputError);
  EXPECT_THROW(residuals::find_flights({folder / "notes.txt"}), files::InputError);
}

residuals::Inputs visible(const std::string& scenario, bool published) {
  residuals::InputArguments arguments;
  arguments.flights = {data_path("flights/" + scenario)};
  arguments.fleet = source_path("analysis/flights/flights.toml");
  arguments.rules.published = published;
  return residuals::read_inputs(arguments);
}

TEST(Compare, GivesTheSameNumbersForAnyNumberOfJobs) {
  SWARMCERT_NEEDS_DATA();
  const residuals::Inputs inputs = visible("visible_test/21_swap_ss", false);
  const auto quiet = [](int, int) {};
  const residuals::Comparison one = residuals::compare(inputs, 1, quiet);
  const residuals::Comparison two = residuals::compare(inputs, 2, quiet);
  EXPECT_EQ(one.overall.statistics.rmse.total, two.overall.statistics.rmse.total);
  EXPECT_EQ(one.overall.rmse_interval.value()[3].lower, two.overall.rmse_interval.value()[3].lower);
  ASSERT_EQ(one.regions.size(), two.regions.size());
  for (std::size_t i = 0; i < one.regions.size(); ++i)
    EXPECT_EQ(region_words(one.regions[i], {}), region_words(two.regions[i], {}));
}

TEST(Compare, WhatASearchWantsToKnowIsThatOfTheWholeComparison) {
  SWARMCERT_NEEDS_DATA();
  const residuals::Inputs inputs = visible("visible_test/21_swap_ss", false);
  const residuals::Comparison all = residuals::compare(inputs, 2, [](int, int) {});
  const residuals::Leftover left = residuals::left_over(inputs, 2);
  EXPECT_EQ(left.rmse_N, all.overall.statistics.rmse.total);
  EXPECT_EQ(left.low_band_to_floor, all.overall.low_band_to_floor);
  EXPECT_EQ(left.noise_floor_N, all.overall.noise_floor_N);
  std::array<double, residuals::kNumVariables> shares{};
  for (const residuals::RegionErrors& region : all.regions)
    shares[static_cast<std::size_t>(region.variable)] += region.share;
  for (std::size_t v = 0; v < shares.size(); ++v) {
    EXPECT_GT(left.region_shares[v], 0);
    EXPECT_NEAR(left.region_shares[v], shares[v], 1e-12);
  }
}

TEST(Compare, NamesTheDownwashRegionOfSwapsFirst) {
  SWARMCERT_NEEDS_DATA();
  const residuals::Comparison comparison =
      residuals::compare(visible("visible_test/21_swap_ss", false), 0, [](int, int) {});
  ASSERT_FALSE(comparison.regions.empty());
  bool found = false;
  for (std::size_t i = 0; i < 4; ++i)
    found = found || region_words(comparison.regions[i], {}).find("below a vehicle") != std::string::npos;
  EXPECT_TRUE(found);
}

TEST(FlightCommands, GiveNoAnswerWithoutAUsableRecord) {
  const ScratchFolder folder;
  write_text(folder / "cf1_00", "");
  const std::string model = source_path("stability/models/crazyflie-small.toml");
  // compare names the unreadable file; the other commands report that there are no data to decide.
  for (const auto& [command, exit_code] : {std::pair("compare " + model + " .", 3),
                                           {"diagnose " + model + " .", 4},
                                           {"add auto --model " + model + " . -o new.toml", 4}}) {
    const Outcome outcome = run_shell("swarmcert " + command, folder.path());
    EXPECT_EQ(outcome.exit_code, exit_code) << command << "\n" << outcome.output;
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "new.toml"));
}

/// network.toml for the networks that were published with the flights.
std::string published_network() {
  std::string network = "schema = \"swarmcert/network/1\"\n";
  for (const char* part :
       {"phi.small:phi_S", "phi.large:phi_L", "phi.ground:phi_G", "rho.small:rho_S", "rho.large:rho_L"}) {
    const std::string text(part);
    const std::size_t colon = text.find(':');
    network +=
        "[" + text.substr(0, colon) + "]\nweights = \"" +
        std::filesystem::absolute(data_path("weights/zip_f32/" + text.substr(colon + 1) + ".pth")).string() +
        "\"\n";
  }
  return network;
}

TEST(Compare, ReproducesTheErrorsOfThePublishedNetworks_slow) {
  SWARMCERT_NEEDS_DATA();
  // Mean squares of f_a,z in gf^2 over the shared flights, with the authors' own filter. Keys: kinds of the
  // neighbours, then of the vehicle; Ge: no neighbour.
  const std::map<std::string, double> published = {
      {"Ge2L", 3.12},  {"Ge2S", 0.87},  {"L2L", 8.05},  {"S2S", 1.09},  {"L2S", 1.47},  {"S2L", 4.55},
      {"SS2L", 11.07}, {"SL2L", 14.68}, {"LL2S", 1.55}, {"SL2S", 2.52}, {"SS2S", 2.11}, {"LL2L", 11.18}};
  const ScratchFolder folder;
  write_text(folder / "network.toml", published_network());
  const Outcome outcome =
      run_shell("swarmcert compare " + std::filesystem::absolute(data_path("flights")).string() +
                    " --network network.toml --published-filter --json result.json",
                folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json result = files::read_json(folder / "result.json", "swarmcert/compare/1");
  const files::Json& found = result["mean_square_z_gf2"];
  ASSERT_EQ(found.size(), published.size());
  for (const auto& [row, mean_square] : published) {
    ASSERT_TRUE(found.contains(row)) << row;
    EXPECT_NEAR(found[row].get<double>(), mean_square, 0.05 * mean_square) << row;
    EXPECT_TRUE(result["mean_square_z_gf2_own_filter"].contains(row)) << row;
  }
}

/// Two simulated vehicles fly past each other; the model of the second comparison lacks their downwash.
TEST(Trajectory, FollowsTheFlightThatTheModelMadeAndMissesWhatItLacks) {
  const ScratchFolder folder;
  const std::string gains = source_path("controller/gains/crazyflie-small.toml");
  const std::string truth = source_path("stability/models/crazyflie-small-effects.toml");
  const std::string nominal = source_path("stability/models/crazyflie-small.toml");
  ASSERT_EQ(run_shell("swarmcert simulate random-walk --vehicles 2 --duration 15 --seed 3 --model " + truth +
                          " --gains " + gains + " -o flight",
                      folder.path())
                .exit_code,
            0);
  const auto compare = [&](const std::string& words) {
    const Outcome outcome =
        run_shell("swarmcert compare " + words + " --json result.json --force", folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return files::read_json(folder / "result.json", "swarmcert/compare/1");
  };
  const files::Json right = compare(truth + " flight --gains " + gains);
  const files::Json wrong = compare(nominal + " flight --gains small=" + gains);
  const auto rmse_z_m = [](const files::Json& json) { return json["trajectory"]["rmse"]["z"].get<double>(); };
  EXPECT_LT(rmse_z_m(right), 0.005);
  EXPECT_GT(rmse_z_m(wrong), 4 * rmse_z_m(right));
  // The residual contains what the model lacks: driven by it, the loop reaches the measured peaks.
  const files::Json& ratio = wrong["learning_error"]["peak_ratio"];
  EXPECT_EQ(ratio["tracks"], 2);
  EXPECT_NEAR(ratio["p50"]["z"].get<double>(), 1, 0.3);
  const files::Json without = compare(truth + " flight");
  EXPECT_EQ(without["trajectory"]["refused"], "no gains were given");
  EXPECT_TRUE(without["learning_error"]["peak_ratio"].is_null());
}

TEST(Trajectory, IsRefusedWithTheReasonWhereALogHasNoSetPoints) {
  const ScratchFolder folder;
  const std::string gains = source_path("controller/gains/crazyflie-small.toml");
  const std::string model = source_path("stability/models/crazyflie-small.toml");
  // The published CSV layout has no setpoints.
  ASSERT_EQ(run_shell("swarmcert simulate hover --duration 8 --model " + model + " --gains " + gains +
                          " -o flight && swarmcert inspect flight/cf1_00 --csv cf1_01.csv",
                      folder.path())
                .exit_code,
            0);
  const Outcome outcome = run_shell(
      "swarmcert compare " + model + " cf1_01.csv --gains " + gains + " --json result.json", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json result = files::read_json(folder / "result.json", "swarmcert/compare/1");
  EXPECT_EQ(result["trajectory"]["refused"], "the log has no set points");
  EXPECT_GT(result["overall"]["samples"].get<int>(), 500);
}

TEST(CompareReport, IsOneFileInWhichHostileNamesAreTextAndOnlyItsOwnScriptRuns) {
  const ScratchFolder folder;
  const std::string gains = source_path("controller/gains/crazyflie-small.toml");
  const std::string model = source_path("stability/models/crazyflie-small.toml");
  const std::filesystem::path hostile = folder.path() / "<i onload=x>'\"`touch made`$(touch made)";
  ASSERT_EQ(
      run_shell("swarmcert simulate swap --vehicles 2 --model " + model + " --gains " + gains + " -o flight",
                folder.path())
          .exit_code,
      0);
  std::filesystem::rename(folder.path() / "flight", hostile);
  const Outcome outcome =
      run_shell("swarmcert compare . " + model + " --report \"out'\\`touch made\\`\"", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "made"));
  const std::string html = read_text((folder.path() / "out'`touch made`" / "report.html").string());
  EXPECT_EQ(html.find("<i onload"), std::string::npos);
  EXPECT_NE(html.find("&lt;i onload"), std::string::npos);
  EXPECT_EQ(html.find("Not drawn"), std::string::npos);
  EXPECT_EQ(html.find("'unsafe-eval'"), std::string::npos);
  EXPECT_EQ(html.find("'unsafe-inline'"), std::string::npos);
  EXPECT_NE(html.find("script-src 'sha256-"), std::string::npos);
  const bool has_zoom = html.find("id=\"time-series\"") != std::string::npos;
  EXPECT_NE(has_zoom, html.find("built without dygraphs") != std::string::npos);
}

TEST(TorqueResidual, IsGivenWhereTheLogIsAsFastAsTheLoopAndRefusedWhereItAliases) {
  const ScratchFolder folder;
  const std::string gains = source_path("controller/gains/crazyflie-small-nominal.toml");
  std::string model = read_text(source_path("stability/models/crazyflie-small.toml"));
  write_text(folder / "slow.toml", model);
  const std::string rate = "log_rate_hz = 100.0";
  ASSERT_NE(model.find(rate), std::string::npos);
  model.replace(model.find(rate), rate.size(), "log_rate_hz = 500.0");
  const std::string lag = "\n[[effect]]\nname = \"motor_lag\"\n";
  write_text(folder / "fast.toml", model + lag);
  // The torque that acted, 1.5e-4 N m about y, is missing in fast.toml.
  write_text(folder / "truth.toml",
             model + lag + "\n[[effect]]\nname = \"torque_bias\"\nparameters = { torque_y_Nm = 1.5e-4 }\n");
  const auto compare = [&](const std::string& truth, const std::string& name) {
    EXPECT_EQ(run_shell("swarmcert simulate circle --duration 6 --model " + truth + " --gains " + gains +
                            " -o " + name,
                        folder.path())
                  .exit_code,
              0);
    const std::string judged = truth == "truth.toml" ? "fast.toml" : truth;
    const Outcome outcome =
        run_shell("swarmcert compare " + judged + " " + name + " --json " + name + ".json", folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return files::read_json(folder / (name + ".json"), "swarmcert/compare/1");
  };
  const files::Json fast = compare("truth.toml", "fast");
  ASSERT_EQ(fast["torque"]["tracks"], 1) << fast["torque"];
  const files::Json& torque = fast["flights"][0]["torque"];
  EXPECT_NEAR(torque["bias"]["y"].get<double>(), 1.5e-4, 0.2e-4);
  EXPECT_NEAR(torque["bias"]["x"].get<double>(), 0, 0.2e-4);
  const files::Json slow = compare("slow.toml", "slow");
  EXPECT_EQ(slow["torque"]["refused"], "logs at 100 Hz alias the attitude loop: torques need 400 Hz");
}

/// RMS of the vertical residual in a row of a budget, N.
double rmse_z_N(const files::Json& budget, const std::string& row, const std::string& group) {
  for (const files::Json& entry : budget["rows"]) {
    if (entry["name"] == row) return entry["rmse_z"][group].get<double>();
  }
  ADD_FAILURE() << "no row " << row;
  return 0;
}

/// The vehicles flew with the published mass; their model states 60 g.
TEST(Budget, TriesThePublishedMassOfEveryPublishedKind) {
  const ScratchFolder folder;
  const std::string flown = source_path("stability/models/crazyflie-large.toml");
  std::string light = read_text(flown);
  light.replace(light.find("mass_kg = 0.067"), 15, "mass_kg = 0.060");
  write_text(folder / "light.toml", light);
  for (const std::string seed : {"1", "2"}) {
    ASSERT_EQ(run_shell("swarmcert simulate random-walk -q --vehicles 2 --duration 8 --seed " + seed +
                            " --model " + flown + " --gains " +
                            source_path("controller/gains/crazyflie-large.toml") + " -o " + seed,
                        folder.path())
                  .exit_code,
              0);
  }
  const Outcome outcome =
      run_shell("swarmcert compare light.toml 2 --budget 1 --json budget.json", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json budget = files::read_json(folder / "budget.json", "swarmcert/compare/1")["budget"];
  EXPECT_EQ(budget["nominal_mass_kg"]["large"], 0.067);
}

TEST(Budget, FallsToTheNoiseOnFlightsWhoseEffectsItKnowsAndItsModelsReproduceTheLastRow) {
  const ScratchFolder folder;
  const std::string gains = source_path("controller/gains/crazyflie-small.toml");
  const std::string truth = source_path("stability/models/crazyflie-small-effects.toml");
  const std::string nominal = source_path("stability/models/crazyflie-small.toml");
  for (const std::string seed : {"1", "2", "3"}) {
    ASSERT_EQ(
        run_shell("swarmcert simulate random-walk --vehicles 2 --duration 20 --seed " + seed + " --model " +
                      truth + " --gains " + gains + " -o " + (seed == "3" ? "test/" : "fit/") + seed,
                  folder.path())
            .exit_code,
        0);
  }
  const Outcome outcome =
      run_shell("swarmcert compare " + nominal + " test --budget fit --fitted fitted --json budget.json",
                folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json budget = files::read_json(folder / "budget.json", "swarmcert/compare/1")["budget"];
  EXPECT_LT(rmse_z_N(budget, "rest", "all"), 0.35 * rmse_z_N(budget, "nominal", "all"));
  EXPECT_EQ(budget["nominal_mass_kg"]["small"], 0.034) << "what flew";
  ASSERT_EQ(run_shell("swarmcert compare test --flights fitted/flights.toml --json again.json", folder.path())
                .exit_code,
            0);
  const files::Json again = files::read_json(folder / "again.json", "swarmcert/compare/1");
  EXPECT_NEAR(again["overall"]["rmse"]["z"].get<double>(), rmse_z_N(budget, "rest", "all"), 1e-9);
  for (const char* same : {"test", "./fit/../test/3"}) {
    EXPECT_EQ(run_shell("swarmcert compare " + nominal + " test --budget " + same, folder.path()).exit_code,
              2)
        << "fitted and judged on the same flights";
  }
}

TEST(Budget, ItsModelsLeaveTheVehiclesOutWhosePositionAloneIsKnown) {
  const ScratchFolder folder;
  const std::string nominal = source_path("stability/models/crazyflie-small.toml");
  write_text(folder / "flights.toml", "schema = \"swarmcert/flights/1\"\n[vehicle.cf1]\nmodel = \"" +
                                          nominal + "\"\n[vehicle.cf2]\nmodel = \"" + nominal +
                                          "\"\nuse = \"position\"\n");
  for (const std::string seed : {"1", "2"}) {
    ASSERT_EQ(run_shell("swarmcert simulate random-walk --vehicles 2 --duration 15 --seed " + seed +
                            " --model " + source_path("stability/models/crazyflie-small-effects.toml") +
                            " --gains " + source_path("controller/gains/crazyflie-small.toml") + " -o " +
                            (seed == "2" ? "test/" : "fit/") + seed,
                        folder.path())
                  .exit_code,
              0);
  }
  const Outcome outcome = run_shell(
      "swarmcert compare --flights flights.toml test --budget fit --fitted fitted --json budget.json",
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  ASSERT_EQ(run_shell("swarmcert compare test --flights fitted/flights.toml --json again.json", folder.path())
                .exit_code,
            0);
  const files::Json again = files::read_json(folder / "again.json", "swarmcert/compare/1");
  EXPECT_TRUE(again["vehicles"].contains("cf1")) << again["vehicles"].dump(1);
  EXPECT_FALSE(again["vehicles"].contains("cf2")) << again["vehicles"].dump(1);
  const files::Json budget = files::read_json(folder / "budget.json", "swarmcert/compare/1")["budget"];
  EXPECT_NEAR(again["overall"]["rmse"]["z"].get<double>(), rmse_z_N(budget, "rest", "all"), 1e-9);
}

TEST(Budget, OfThePublishedFlightsFallsByHalfAndReachesTheNetworks_slow) {
  SWARMCERT_NEEDS_DATA();
  const ScratchFolder folder;
  write_text(folder / "network.toml", published_network());
  const std::string flights = std::filesystem::absolute(data_path("flights")).string();
  const Outcome outcome = run_shell("swarmcert compare " + flights + "/visible_test --budget " + flights +
                                        "/development --network network.toml --json budget.json",
                                    folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json budget = files::read_json(folder / "budget.json", "swarmcert/compare/1")["budget"];
  const std::map<std::string, double> least_drop = {
      {"S2S", 0.5}, {"Ge2S", 0.5}, {"L2L", 0.5}, {"Ge2L", 0.45}};
  for (const auto& [group, drop] : least_drop) {
    EXPECT_GE(budget["drop"][group].get<double>(), drop) << group;
    EXPECT_LE(budget["rest_over_network"][group].get<double>(), 1.05) << group;
  }
  EXPECT_LE(budget["rest_over_network"]["all"].get<double>(), 1.05);
}

}  // namespace
}  // namespace swarmcert::tests

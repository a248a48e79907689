// bound as a user runs it: promises for a further flight, and the margins of the attitude loop.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/tracking_runs.h"

namespace swarmcert::tests {
namespace {

using files::Json;

/// Gain sets used in flight: 111 without a limit cycle, 119 and one axis of 29 with one.
TEST(BoundCommand, SaysWhichGainsAreCloseToALimitCycleOfTheAttitudeLoop) {
  const ScratchFolder folder;
  std::string model = read_text(kSourceFolder + "/stability/models/crazyflie-small.toml");
  write_text(folder / "model.toml",
             model + "\n[[effect]]\nname = \"thrust_ratio\"\nparameters = { ratio = 0.5 }\n");
  const auto verdict = [&](const std::string& position, const std::string& attitude) {
    write_text(folder / "gains.toml",
               "schema = \"swarmcert/gains/1\"\n[position]\n" + position + "\n[lag]\nmotor_s = 0.0575\n");
    const Json result =
        json_of(folder, "bound --gains gains.toml --model model.toml --attitude-gains " + attitude);
    EXPECT_EQ(result["attitude"].size(), 2u);
    return result["attitude"][0];
  };
  const Json calm = verdict("Kp = 17\nKd = 7\nKi = 10", "0.010,0.001125,0.040");
  EXPECT_EQ(calm["verdict"], "clear") << calm;
  EXPECT_GT(calm["exact"]["torque"]["amplitude"].get<double>(), 0);
  EXPECT_EQ(verdict("Kp = 9\nKd = 7\nKi = 0", "0.007,0.001125,0.040")["verdict"], "close to a limit cycle");
  EXPECT_EQ(verdict("Kp = 9\nKd = 7\nKi = 5", "0.0055,0.0013,0.018")["verdict"], "close to a limit cycle");
  const Json unstable = verdict("Kp = 9\nKd = 7\nKi = 0", "0.009,0.002,0.040");
  EXPECT_EQ(unstable["verdict"], "unstable");
  EXPECT_FALSE(unstable["stable"].get<bool>());
  EXPECT_TRUE(unstable["exact"]["force"]["amplitude"].is_null());
  for (const std::string wrong : {"1,2", "0.01,0,0", "a,b,c", "0.01,0.001,-1", "0.01,0.001,0.04,1"}) {
    EXPECT_EQ(run_shell("swarmcert bound --gains gains.toml --model model.toml --attitude-gains " + wrong,
                        folder.path())
                  .exit_code,
              2)
        << wrong;
  }
}

TEST(BoundCommand, TakesTheGainsOfTheAttitudeLawFromTheFileThatFlies) {
  const ScratchFolder folder;
  const std::string model = kSourceFolder + "/stability/models/crazyflie-small.toml";
  const auto attitude_of = [&](const std::string& tables, const std::string& words) {
    write_text(folder / "gains.toml",
               "schema = \"swarmcert/gains/1\"\n[position]\nKp = 9\nKd = 7\nKi = 0\n" + tables);
    const Json result = json_of(folder, "bound --gains gains.toml --model " + model + words);
    return result.contains("attitude") ? result["attitude"] : Json();
  };
  const std::string lag = "[lag]\nmotor_s = 0.0575\n";
  const std::string law = "[attitude]\nKR = 0.007\nKw = 0.00115\nKI = 0.03\n";
  const Json told = attitude_of(lag, " --attitude-gains 0.007,0.00115,0.03");
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(attitude_of(law + lag, ""), told);
  EXPECT_TRUE(attitude_of(lag, "").is_null());
  EXPECT_EQ(attitude_of("[attitude]\nKR = 1\nKw = 1\n" + lag, " --attitude-gains 0.007,0.00115,0.03"), told)
      << "the option comes first";
  // The gains are about body axes: motion along x requires a tilt about y.
  const Json softer = attitude_of("[attitude]\nKR = [0.007, 0.003, 1]\nKw = 0.00115\nKI = 0.03\n" + lag, "");
  EXPECT_EQ(softer[1], told[1]);
  EXPECT_NE(softer[0], told[0]);
  const Json late = attitude_of(law + "[lag]\nmotor_s = 0.0575\nbody_rate_s = 0.005\n", "");
  EXPECT_EQ(told[0]["verdict"], "clear");
  EXPECT_EQ(late[0]["verdict"], "close to a limit cycle");
  EXPECT_LT(late[0]["delay_margin_s"].get<double>(), told[0]["delay_margin_s"].get<double>());
  write_text(folder / "gains.toml",
             "schema = \"swarmcert/gains/1\"\n[position]\nKp = 9\nKd = 7\nKi = 0\n[attitude]\nKR = 0.007\n");
  const Outcome half = run_shell("swarmcert bound --gains gains.toml --model " + model, folder.path());
  EXPECT_EQ(half.exit_code, 3);
  EXPECT_NE(half.output.find("Kw"), std::string::npos) << half.output;
}

/// Axes coupled by Lambda and K have one common row for their joint loop; the other axes keep their own rows.
TEST(BoundCommand, CoupledAxesHaveMarginsOfTheAttitudeLoopAsOneLoop) {
  const ScratchFolder folder;
  const std::string law =
      "[attitude]\nKR = 0.007\nKw = 0.00115\nKI = 0.02\n[lag]\nmotor_s = 0.0575\nbody_rate_s = 0.003\n";
  const auto result_of = [&](const std::string& position) {
    const std::string gains = gains_file(folder, "[position]\n" + position + "rate_hz = 500\n" + law);
    return json_of(folder, "bound" + gains)["attitude"];
  };
  const Json straight = result_of("Lambda = [1.2, 1.8, 2]\nK = [0.12, 0.15, 0.2]\n");
  ASSERT_EQ(straight.size(), 2u);
  EXPECT_EQ(straight[0]["axis"], "x");
  EXPECT_FALSE(straight[0].contains("channels"));

  const Json pair = result_of("Lambda = [[1.2, 0.3, 0], [0.3, 1.8, 0], [0, 0, 2]]\nK = [0.12, 0.15, 0.2]\n");
  ASSERT_EQ(pair.size(), 1u);
  EXPECT_EQ(pair[0]["axis"], "xy");
  EXPECT_TRUE(pair[0]["stable"].get<bool>());
  ASSERT_EQ(pair[0]["channels"].size(), 2u);
  double least = 1;
  for (const Json& row : straight) least = std::min(least, row["damping"].get<double>());
  EXPECT_GT(std::abs(pair[0]["damping"].get<double>() - least), 1e-3) << pair[0];
  EXPECT_TRUE(pair[0]["exact"].is_null());
  EXPECT_NE(pair[0]["why_no_exact"].get<std::string>().find("coupled"), std::string::npos);
  // A tiny coupling changes the result only slightly.
  const Json hardly =
      result_of("Lambda = [[1.2, 1e-9, 0], [1e-9, 1.8, 0], [0, 0, 2]]\nK = [0.12, 0.15, 0.2]\n");
  for (const char* const margin : {"gain_margin", "delay_margin_s"}) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double own = straight[i][margin].get<double>();
      EXPECT_NEAR(hardly[0]["channels"][i][margin].get<double>(), own, 1e-6 * own) << margin;
    }
  }
  const Json beside =
      result_of("Lambda = [[1.2, 0, 0.3], [0, 1.8, 0], [0.3, 0, 2]]\nK = [0.12, 0.15, 0.2]\n");
  ASSERT_EQ(beside.size(), 2u);
  EXPECT_EQ(beside[0], straight[1]) << "y has a loop of its own";
  EXPECT_EQ(beside[1]["axis"], "xz");
  const Outcome text =
      run_shell("swarmcert bound" + gains_file(folder,
                                               "[position]\nLambda = [[1.2, 0.3, 0], [0.3, 1.8, 0], "
                                               "[0, 0, 2]]\nK = 0.12\n" +
                                                   law),
                folder.path());
  EXPECT_NE(text.output.find("as one loop with all motors"), std::string::npos) << text.output;
}

/// A result of compare whose flights had these amplitudes along all axes; the other values are arbitrary.
/// @param velocity_m_s amplitude of the velocity error of every flight; 0: not measured.
std::string compared_flights(const ScratchFolder& folder, const std::vector<double>& amplitudes,
                             double velocity_m_s = 0) {
  Json flights = Json::array();
  for (std::size_t k = 0; k < amplitudes.size(); ++k) {
    const auto axes = [](double x) { return Json{{"x", x}, {"y", x}, {"z", x}, {"total", x}}; };
    flights.push_back({{"flight", "flight" + std::to_string(k)},
                       {"vehicle", "cf1"},
                       {"learning_error",
                        {{"windows", 3},
                         {"bias", axes(0)},
                         {"amplitude", axes(amplitudes[k])},
                         {"rate", axes(1e6)},
                         {"variation", axes(1e6)},
                         {"impulse", axes(1e6)}}}});
    if (velocity_m_s == 0) continue;
    flights.back()["velocity_error"] = flights.back()["learning_error"];
    flights.back()["velocity_error"]["amplitude"] = axes(velocity_m_s);
  }
  const Json compare = {{"schema", "swarmcert/compare/1"},
                        {"unit", "N"},
                        {"learning_error", {{"window_s", 4.5}, {"bias", 0}, {"amplitude", 1}, {"rate", 1}}},
                        {"flights", flights}};
  write_text(folder / "compare.json", compare.dump());
  return " --from compare.json";
}

TEST(BoundCommand, PromisesAFurtherFlightTheBoundOfTheRankThatConformalPredictionNames) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n");
  std::vector<double> amplitudes;
  for (int k = 1; k <= 19; ++k) amplitudes.push_back(0.01 * k);
  const std::string from = compared_flights(folder, amplitudes);
  const Json result = json_of(folder, "bound" + gains + from + " --coverage 0.9");
  const Json& promise = result["coverage"];
  EXPECT_EQ(promise["level"], 0.9);
  EXPECT_EQ(promise["flights"], 19);
  // k = ceil(0.9 * 20) = 18 of 19: Beta(18, 2), quantiles by the incomplete beta function.
  EXPECT_NEAR(promise["interval"][0].get<double>(), 0.7736, 1e-3);
  EXPECT_NEAR(promise["interval"][1].get<double>(), 0.9810, 1e-3);
  // The bound for the class of the 18th flight, whose rate gives no bound.
  const Json of_class = json_of(folder, "bound" + gains + " --amplitude 0.18");
  ASSERT_EQ(promise["bounds"].size(), of_class["bounds"].size());
  for (std::size_t k = 0; k < promise["bounds"].size(); ++k) {
    const double expected = of_class["bounds"][k]["total"].get<double>();
    EXPECT_NEAR(promise["bounds"][k]["total"].get<double>(), expected, 0.01 * expected) << k;
  }
}

TEST(BoundCommand, APromiseContainsWhatIsDeclaredBesideTheFlights) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nKp = 9\nKd = 7\nKi = 0\n");
  const std::string from = compared_flights(folder, std::vector<double>(9, 0.01)) + " --coverage 0.9";
  const auto total = [&](const std::string& more) {
    return json_of(folder, "bound" + gains + from + more)["coverage"]["bounds"][0]["total"].get<double>();
  };
  const double alone = total("");
  EXPECT_NEAR(total(" --bias 0.1") - alone, 0.1 / 0.034 / 9, 1e-6);
  const double declared = total(" --velocity-error 0.1");
  EXPECT_GT(declared, alone + 0.05);
  compared_flights(folder, std::vector<double>(9, 0.01), 0.1);
  EXPECT_NEAR(total(""), declared, 1e-9) << "measured in every flight";
  EXPECT_EQ(total(" --velocity-error 0"), alone) << "what is declared takes its place";
}

TEST(CompareCommand, SaysHowOftenAPromiseHeldOnFlightsThatItWasNotMadeFrom) {
  const ScratchFolder folder;
  const std::string model = kSourceFolder + "/stability/models/crazyflie-small.toml";
  const std::string gains = kSourceFolder + "/controller/gains/crazyflie-small.toml";
  for (const std::string seed : {"1", "2"}) {
    json_of(folder, "simulate swap --vehicles 2 --model " + model + " --gains " + gains + " --seed " + seed +
                        " -o flights/" + seed);
  }
  const Json first = json_of(folder, "compare " + model + " flights/1");
  const auto row = [](const char* axis, double total) {
    return Json{{"axis", axis}, {"channel", "force"}, {"loop", "sampled"}, {"total", total}, {"unit", "m"}};
  };
  Json made_from = Json::array();
  for (const Json& input : first["inputs"]) made_from.push_back(input["sha256"]);
  const Json bound = {
      {"schema", "swarmcert/bound/1"},
      {"coverage",
       {{"level", 0.9}, {"made_from", made_from}, {"bounds", {row("x", 10), row("y", 10), row("z", 1e-9)}}}}};
  write_text(folder / "bound.json", bound.dump());
  const Json result = json_of(folder, "compare " + model + " flights --promise bound.json");
  const Json& promise = result["promise"];
  EXPECT_EQ(promise["level"], 0.9);
  EXPECT_EQ(promise["left_out"].size(), 2u) << "both vehicles of the flight that it was made from";
  for (const Json& axis : promise["axes"]) {
    EXPECT_EQ(axis["flights"], 1) << axis;
    EXPECT_EQ(axis["held"], axis["axis"] == "z" ? 0 : 1) << axis;
  }
  const Outcome text =
      run_shell("swarmcert compare " + model + " flights --promise bound.json", folder.path());
  EXPECT_NE(text.output.find("x: held in 1 of 1 flights"), std::string::npos) << text.output;
  EXPECT_NE(text.output.find("left out: 2 logs"), std::string::npos) << text.output;
  EXPECT_EQ(
      run_shell("swarmcert compare " + model + " flights --promise compare.json", folder.path()).exit_code,
      3);
}

TEST(BoundCommand, RefusesAPromiseThatTheFlightsCannotCarry) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n");
  const auto run = [&](const std::string& words) {
    return run_shell("swarmcert bound" + gains + words, folder.path());
  };
  const std::string from = compared_flights(folder, std::vector<double>(8, 0.01));
  const Outcome few = run(from + " --coverage 0.9");
  EXPECT_EQ(few.exit_code, 3) << few.output;
  EXPECT_NE(few.output.find("at least 9"), std::string::npos) << few.output;
  // Kept, whatever the answer is for the 1 N that all flights together may have.
  EXPECT_EQ(run(from + " --coverage 0.8").exit_code, run(from).exit_code);
  EXPECT_EQ(json_of(folder, "bound" + gains + from + " --coverage 0.8")["coverage"]["flights"], 8);
  EXPECT_EQ(run(" --amplitude 1 --coverage 0.9").exit_code, 2) << "no flights";
  EXPECT_EQ(run(from + " --coverage 1").exit_code, 2);
  write_text(
      folder / "compare.json",
      R"({"schema": "swarmcert/compare/1", "learning_error": {"window_s": 4.5, "amplitude": 1, "rate": 1},
                 "flights": [{"flight": "a"}]})");
  EXPECT_EQ(run(" --from compare.json --coverage 0.5").exit_code, 3) << "of an older version";
}

}  // namespace
}  // namespace swarmcert::tests

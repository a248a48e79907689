// bound as a user runs it: sources of the force error, uncertain and coupled loops, swarms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/tracking_runs.h"

namespace swarmcert::tests {
namespace {

using files::Json;

TEST(BoundCommand, ANetworkAloneBoundsTheRateOfFHatAndGivesNoBall) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n");
  const std::string network = " --network " + kSourceFolder + "/nn/networks/demo/network.toml";
  const Json result = json_of(folder, "bound" + gains + network + " --speed 1 --accel 2");
  EXPECT_EQ(result["disturbance"]["source"], "rate of f_hat");
  EXPECT_GT(result["disturbance"]["f_hat_rate_N_s"].get<double>(), 0);
  EXPECT_TRUE(result["theorem"]["ball"].is_null());
  EXPECT_EQ(run_shell("swarmcert bound" + gains + network, folder.path()).exit_code, 2);
}

TEST(BoundCommand, ASilentCompositionLeavesTheRateAndIsNamedBesideIt) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n");
  std::filesystem::copy(kSourceFolder + "/nn/networks/demo", folder / "net");
  const std::string command = "bound" + gains + " --network net/network.toml --speed 1 --accel 2";
  const Json plain = json_of(folder, command);
  std::string toml = read_text(folder / "net/network.toml");
  write_text(folder / "net/network.toml",
             toml.insert(toml.find("output"), "silent = [\"small+small>small\"]\n"));
  const Json silent = json_of(folder, command);
  EXPECT_EQ(silent["disturbance"]["f_hat_rate_N_s"], plain["disturbance"]["f_hat_rate_N_s"]);
  const std::string certificate = " --certificate net/cert.json";
  ASSERT_EQ(
      run_shell("swarmcert certify net/network.toml --nodes 1 -q -o net/cert.json", folder.path()).exit_code,
      0);
  EXPECT_LT(json_of(folder, command + certificate)["disturbance"]["f_hat_rate_N_s"],
            plain["disturbance"]["f_hat_rate_N_s"]);
  const Outcome told = run_shell("swarmcert " + command, folder.path());
  EXPECT_NE(told.output.find("0 among small+small>small"), std::string::npos) << told.output;
}

TEST(BoundCommand, MeasuredQuantilesAreTaggedMeasured) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n");
  write_text(
      folder / "compare.json",
      R"({"schema": "swarmcert/compare/1", "learning_error": {"rate": {"x": {"p99": 0.1}, "y": {"p99": 0.2},
                "z": {"p99": 0.3}}, "amplitude": {"x": {"p99": 1}, "y": {"p99": 1}, "z": {"p99": 1}}}})");
  const Json result = json_of(folder, "bound" + gains + " --from compare.json");
  EXPECT_EQ(result["disturbance"]["source"], "measured");
  EXPECT_NEAR(result["theorem"]["ball"].get<double>(), std::sqrt(0.14) * 0.45955882352941174, 1e-12);
  bool tagged = false;
  for (const Json& a : result["assumptions"]) tagged = tagged || a["status"] == "measured";
  EXPECT_TRUE(tagged);
  EXPECT_EQ(
      run_shell("swarmcert bound" + gains + " --from compare.json --quantile p50", folder.path()).exit_code,
      3);
}

TEST(BoundCommand, TheErrorOfTheVelocityThatFlightsShowedIsAChannelOfItsOwn) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nKp = 10\nKd = 5\nKi = 10\nrate_hz = 100\n");
  const auto at = [](double x, double y, double z) {
    return Json{{"p95", {{"x", x / 2}, {"y", y / 2}, {"z", z / 2}}}, {"p99", {{"x", x}, {"y", y}, {"z", z}}}};
  };
  Json compare = {{"schema", "swarmcert/compare/1"},
                  {"learning_error",
                   {{"window_s", 4.5},
                    {"bias", at(0, 0, 0)},
                    {"amplitude", at(0.01, 0.01, 0.01)},
                    {"rate", at(1, 1, 1)}}}};
  write_text(folder / "force.json", compare.dump());
  compare["velocity_error"] = {
      {"window_s", 4.5},          {"bias", at(0.01, 0, 0)},     {"amplitude", at(0.12, 0.02, 0)},
      {"rate", at(0.05, 100, 0)}, {"variation", at(0.6, 1, 0)}, {"impulse", at(0.2, 1, 0)}};
  write_text(folder / "both.json", compare.dump());
  const auto rows_of = [&](const std::string& from) {
    return json_of(folder, "bound" + gains + " --from " + from);
  };
  const Json force = rows_of("force.json"), both = rows_of("both.json");
  const Json declared = rows_of("both.json --velocity-error 0"), low = rows_of("both.json --quantile p95");
  ASSERT_EQ(both["disturbance"]["of_estimates"].size(), 2u);
  EXPECT_EQ(both["disturbance"]["of_estimates"][0]["rate_per_s"], 0.05);
  EXPECT_EQ(low["disturbance"]["of_estimates"][0]["amplitude"], 0.06);
  for (std::size_t k = 0; k < both["bounds"].size(); ++k) {
    const Json& row = both["bounds"][k];
    const double part_m = row["parts"]["velocity_error"].get<double>();
    EXPECT_NEAR(row["amplitude"].get<double>(), force["bounds"][k]["amplitude"].get<double>() + part_m,
                1e-12);
    EXPECT_EQ(declared["bounds"][k], force["bounds"][k]);
    if (row["axis"] == "x") {
      EXPECT_GT(part_m, 0.02);
    } else if (row["axis"] == "z") {
      EXPECT_EQ(part_m, 0);
    }
  }
  // A fast error of y counts by its amplitude, a slow error of x by less than that.
  for (const Json& exact : both["exact"]) {
    if (exact["channel"] != "velocity" || exact["loop"] != "continuous") continue;
    const auto part_of = [&](const char* axis) {
      for (const Json& row : both["bounds"]) {
        if (row["axis"] == axis && row["loop"] == "continuous")
          return row["parts"]["velocity_error"].get<double>();
      }
      return -1.0;
    };
    const double gain = exact["amplitude"].get<double>();
    if (exact["axis"] == "x") {
      EXPECT_LT(part_of("x"), 0.12 * gain);
    } else if (exact["axis"] == "y") {
      EXPECT_NEAR(part_of("y"), 0.02 * gain, 1e-6);
    }
  }
  // The tube over time also contains the measured velocity error.
  const auto last_of = [&](const std::string& more) {
    return json_of(folder, "bound" + gains + " --from both.json --tube" + more)["tube"][0]["at"]
        .back()["error_m"]
        .get<double>();
  };
  EXPECT_GT(last_of(""), last_of(" --velocity-error 0") + 1e-3);
}

/// Flights with an effect that the model lacks: the result of compare bounds the errors in these flights.
TEST(BoundCommand, MeasuredNumbersOfRealFlightsBoundTheErrorsOfThoseFlights) {
  const ScratchFolder folder;
  const std::string truth = kSourceFolder + "/stability/models/crazyflie-small-effects.toml";
  const std::string gains = kSourceFolder + "/controller/gains/crazyflie-small.toml";
  const Json flown =
      json_of(folder, "simulate swap --vehicles 2 --model " + truth + " --gains " + gains + " -o flights");
  ASSERT_EQ(run_shell("swarmcert compare " + kSourceFolder +
                          "/stability/models/crazyflie-small.toml flights --json compare.json",
                      folder.path())
                .exit_code,
            0);
  const Json result = json_of(folder, "bound" + kFlown + " --from compare.json --quantile max");
  EXPECT_EQ(result["disturbance"]["source"], "measured");
  double error_z = 0;
  for (const Json& vehicle : flown["vehicles"])
    error_z = std::max(error_z, vehicle["max"]["z"].get<double>());
  int rows = 0;
  for (const Json& row : result["bounds"]) {
    if (row["axis"] != "z" || row["loop"] != "sampled" || row["channel"] != "force") continue;
    ++rows;
    EXPECT_EQ(row["guarantee"], "bound");
    EXPECT_GE(row["minimum"].get<double>(), error_z);
    EXPECT_LT(row["minimum"].get<double>(), 8 * error_z);
  }
  EXPECT_EQ(rows, 1);
  // Every window may contribute as much again: more than a single impulse, but less than many.
  const double one = result["exact"][9]["between_samples"]["impulse"].get<double>();
  const Json compare = files::parse_json(read_text(folder / "compare.json"), "compare.json");
  const double J = compare["learning_error"]["impulse"]["max"]["z"].get<double>();
  const Json& velocity = compare["velocity_error"];
  EXPECT_EQ(velocity["windows"], compare["learning_error"]["windows"]);
  double largest_speed = 0;
  for (const Json& flight : compare["flights"])
    largest_speed = std::max(largest_speed, flight["velocity_error"]["amplitude"]["z"].get<double>());
  EXPECT_EQ(velocity["amplitude"]["max"]["z"].get<double>(), largest_speed);
  EXPECT_GT(result["bounds"][9]["parts"]["velocity_error"].get<double>(), 0);
  double largest_of_flights = 0;
  for (const Json& flight : compare["flights"])
    largest_of_flights = std::max(largest_of_flights, flight["learning_error"]["impulse"]["z"].get<double>());
  EXPECT_EQ(largest_of_flights, J);
  EXPECT_GE(result["bounds"][9]["impulse"].get<double>(), 2 * one * J * (1 - 1e-9));
}

TEST(BoundCommand, ADeclaredTruthIsEnclosedAndGivesABall) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n");
  const std::string truth = " --truth " + kSourceFolder +
                            "/stability/models/crazyflie-small-effects.toml --speed 1 --own-speed 1 "
                            "--own-accel 3 --thrust-rate 1 --least-height 0.3 --gap 0.15:0.8";
  const Json result = json_of(folder, "bound" + gains + truth);
  EXPECT_EQ(result["disturbance"]["source"], "declared truth");
  double rate2 = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double rate = 0;
    for (const Json& effect : result["truth"]["effects"]) rate += effect["rate_N_s"][axis].get<double>();
    rate2 += rate * rate;
  }
  EXPECT_NEAR(result["theorem"]["ball"].get<double>(), std::sqrt(rate2) * 0.45955882352941174, 1e-9);
  bool proved = false;
  for (const Json& a : result["assumptions"]) {
    proved = proved || (a["name"] == "constants of the declared truth" && a["status"] == "proved");
  }
  EXPECT_TRUE(proved);
  // A network that should cancel the force adds its own rate; without a bound on the speed nothing is bounded.
  const Json with_network = json_of(folder, "bound" + gains + truth + " --accel 2 --network " +
                                                kSourceFolder + "/nn/networks/demo/network.toml");
  EXPECT_GT(with_network["theorem"]["ball"].get<double>(), result["theorem"]["ball"].get<double>());
  const Outcome unknown = run_shell("swarmcert bound --details" + gains + " --truth " + kSourceFolder +
                                        "/stability/models/crazyflie-small-effects.toml",
                                    folder.path());
  EXPECT_EQ(unknown.exit_code, 4);
  EXPECT_NE(unknown.output.find("needs the relative speed: --speed"), std::string::npos) << unknown.output;
  EXPECT_EQ(run_shell("swarmcert bound" + gains + truth + " --rate 1", folder.path()).exit_code, 2);
  EXPECT_EQ(run_shell("swarmcert bound" + gains + truth + " --gap 3:1", folder.path()).exit_code, 2);
}

TEST(BoundCommand, EnclosuresAndIntervalsContainTheEstimate) {
  const ScratchFolder folder;
  const std::string gains =
      gains_file(folder, "[position]\nKp = 10\nKd = 5\nKi = 10\n[lag]\nmotor_s = 0.0575\n");
  const Json result =
      json_of(folder, "bound" + gains +
                          " --verified --uncertain mass=0.033:0.035 thrust=1:1 lag=0.055:0.06 delay=0:0");
  for (std::size_t i = 0; i < 6; ++i) {
    const Json& exact = result["exact"][i];
    const Json& verified = result["verified"][i];
    ASSERT_EQ(verified["status"], "proved");
    for (const char* gain : {"rate", "amplitude", "edge", "impulse"}) {
      EXPECT_LE(verified[gain][0].get<double>(), exact[gain].get<double>()) << gain;
      EXPECT_GE(verified[gain][1].get<double>(), exact[gain].get<double>()) << gain;
      EXPECT_LT(verified[gain][1].get<double>() - verified[gain][0].get<double>(), 1e-7) << gain;
      EXPECT_GE(result["uncertain"]["gains"][i][gain][1].get<double>(), exact[gain].get<double>()) << gain;
    }
  }
  // The same for the sampled loop, at its samples.
  const Json sampled = json_of(folder, "bound" + kFlown +
                                           " --verified --uncertain mass=0.034:0.0341 thrust=1:1 "
                                           "lag=0.0575:0.0575 delay=0:0");
  for (std::size_t i = 0; i < 12; ++i) {
    const Json& exact = sampled["exact"][i];
    const Json& verified = sampled["verified"][i];
    const Json& uncertain = sampled["uncertain"]["gains"][i];
    ASSERT_EQ(verified["loop"], exact["loop"]);
    ASSERT_EQ(uncertain["loop"], exact["loop"]);
    EXPECT_EQ(verified["status"], "proved");
    EXPECT_EQ(uncertain["status"], "enclosed");
    for (const char* gain : {"rate", "amplitude", "edge", "impulse"}) {
      const double value = exact[gain].get<double>();
      EXPECT_LE(verified[gain][0].get<double>(), value * (1 + 1e-9)) << gain;
      EXPECT_GE(verified[gain][1].get<double>(), value * (1 - 1e-9)) << gain;
      // The weakened integrator leaves a slow pole, and its responses are long.
      const double width = exact["loop"] == "continuous" && exact["axis"] != "z" ? 3e-4 : 1e-5;
      EXPECT_LT(verified[gain][1].get<double>() - verified[gain][0].get<double>(), width * value) << gain;
      EXPECT_GE(uncertain[gain][1].get<double>(), value) << gain;
    }
  }
  const Json nominal =
      json_of(folder, "bound --gains " + kSourceFolder + "/controller/gains/crazyflie-small-nominal.toml" +
                          kModel + " --verified");
  for (std::size_t i = 0; i < 12; ++i) {
    for (const char* gain : {"rate", "amplitude", "edge", "impulse"}) {
      const Json& verified = nominal["verified"][i][gain];
      EXPECT_LT(verified[1].get<double>() - verified[0].get<double>(),
                1e-5 * nominal["exact"][i][gain].get<double>())
          << gain;
    }
  }
  EXPECT_EQ(run_shell("swarmcert bound" + gains + " --uncertain weight=1:2", folder.path()).exit_code, 2);
}

TEST(BoundCommand, ADelayIsVerifiedAndADelayIntervalOnTheFlownGainsEnds) {
  const ScratchFolder folder;
  const Json verified =
      json_of(folder, "bound" +
                          gains_file(folder,
                                     "[position]\nKp = 10\nKd = 5\nKi = 10\n[lag]\nmotor_s = 0.0575\n"
                                     "delay_s = 0.004\n") +
                          " --verified");
  for (std::size_t i = 0; i < 6; ++i) {
    const Json& row = verified["verified"][i];
    ASSERT_EQ(row["status"], "proved");
    EXPECT_LT(row["delay_gain"].get<double>(), 1e-6);
    for (const char* gain : {"rate", "amplitude", "edge", "impulse"}) {
      const double value = verified["exact"][i][gain].get<double>();
      EXPECT_LE(row[gain][0].get<double>(), value * (1 + 1e-10)) << gain;
      EXPECT_GE(row[gain][1].get<double>(), value * (1 - 1e-10)) << gain;
      EXPECT_LT(row[gain][1].get<double>(), (1 + 1e-6) * value) << gain;
    }
  }
  const Json uncertain = json_of(
      folder, "bound" + kFlown + " --uncertain mass=0.034:0.034 thrust=1:1 lag=0.0575:0.0575 delay=0:0.01");
  ASSERT_EQ(uncertain["uncertain"]["gains"].size(), 12u);
  for (const Json& row : uncertain["uncertain"]["gains"]) {
    EXPECT_EQ(row["status"], "enclosed") << row;
    for (const char* gain : {"rate", "amplitude", "edge", "impulse"}) {
      EXPECT_LE(row[gain][0].get<double>(), row[gain][1].get<double>()) << row;
    }
  }
  // An insufficient budget is reported, and the bounds found until then still hold.
  const std::string box = " --uncertain mass=0.032:0.036 thrust=0.9:1.1 lag=0.05:0.065 delay=0:0";
  const Json full = json_of(folder, "bound" + kFlown + box);
  const Json part = json_of(folder, "bound" + kFlown + box + " --loops 8");
  for (std::size_t i = 0; i < 12; ++i) {
    const Json& found = part["uncertain"]["gains"][i];
    EXPECT_EQ(full["uncertain"]["gains"][i]["ended"], "gap reached");
    EXPECT_EQ(found["ended"], "budget spent");
    const double lower = full["uncertain"]["gains"][i]["impulse"][0].get<double>();
    EXPECT_TRUE(found["impulse"][1].is_null() || found["impulse"][1].get<double>() >= lower) << found;
  }
  // A delay that is too long for the vehicle is reported as unstable instead of enclosed.
  const Json unstable = json_of(
      folder, "bound" + kFlown + " --uncertain mass=0.034:0.034 thrust=1:1 lag=0.0575:0.0575 delay=0:0.3");
  EXPECT_EQ(unstable["uncertain"]["gains"][0]["status"], "unstable");
}

TEST(BoundCommand, CoupledAxesAreNamedAndWhatNeedsASingleAxisIsRefused) {
  const ScratchFolder folder;
  const std::string all = gains_file(
      folder,
      "[position]\nLambda = [[3.1, 0.4, -0.2], [0.4, 2.5, 0.3], [-0.2, 0.3, 4.2]]\nK = [0.12, 0.2, 0.09]\n");
  const Outcome text =
      run_shell("swarmcert bound --details" + all + " --rate 0.2 --amplitude 0.1", folder.path());
  EXPECT_EQ(text.exit_code, 4) << text.output;
  EXPECT_NE(text.output.find("couples the axes x, y, z"), std::string::npos) << text.output;
  EXPECT_EQ(text.output.find("No disturbance is declared"), std::string::npos) << text.output;
  EXPECT_EQ(text.output.find("inf"), std::string::npos) << text.output;
  const Json json = json_of(folder, "bound" + all + " --rate 0.2");
  EXPECT_EQ(json["coupled_axes"], Json({"x", "y", "z"}));
  EXPECT_LT(0.2 * json["vector"]["peak_gain"][1].get<double>(), json["theorem"]["ball"].get<double>());
  EXPECT_TRUE(json["vector"]["worst_error_m"].is_null()) << "a rate alone saturates the thrust";
  for (const char* const asked : {"--verified", "--uncertain", "--tube --amplitude 0.1"}) {
    const Outcome refused = run_shell("swarmcert bound" + all + " " + asked, folder.path());
    EXPECT_EQ(refused.exit_code, 2) << asked;
    EXPECT_NE(refused.output.find("gains.toml couples all axes"), std::string::npos) << refused.output;
  }
  const std::string two = gains_file(
      folder, "[position]\nLambda = [[3.1, 0.4, 0], [0.4, 2.5, 0], [0, 0, 4.2]]\nK = [0.12, 0.2, 0.09]\n");
  const Json one_axis = json_of(folder, "bound" + two + " --verified");
  EXPECT_EQ(one_axis["coupled_axes"], Json({"x", "y"}));
  for (const Json& row : one_axis["verified"]) EXPECT_EQ(row["axis"], "z");
  EXPECT_EQ(one_axis["verified"].size(), 4u);
  const Json alone = json_of(folder, "bound" + gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n") +
                                         " --rate 0.3 --amplitude 0.05");
  EXPECT_NEAR(alone["vector"]["worst_error_m"].get<double>(),
              0.3 * alone["vector"]["peak_gain"][1].get<double>(), 1e-15);
}

TEST(BoundCommand, ASwarmsBoundContainsTheErrorsOfItsEstimatesOrSaysWhichAreMissing) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nKp = 10\nKd = 5\nKi = 10\n");
  const std::string proved =
      "bound" + gains + " --swarm " + kSourceFolder + "/stability/bounds/swarms/one-way-pair.toml";
  const Json exact = json_of(folder, proved)["swarm"];
  EXPECT_EQ(exact["of_estimates"]["error_m"], 0);
  const Json errs = json_of(folder, proved + " --velocity-error 0.1 --position-error 0.01")["swarm"];
  EXPECT_EQ(errs["verdict"], "proved");
  for (std::size_t vehicle = 0; vehicle < 2; ++vehicle) {
    const double own_m = errs["of_estimates"]["error_m"].get<double>();
    EXPECT_GT(own_m, 0.01);
    EXPECT_GE(errs["error_m"][vehicle].get<double>(), exact["error_m"][vehicle].get<double>() + own_m);
  }
  for (const char* const body : {"velocity_error_variation_m_s = 0.1\nposition_error_rate_m_s = 1",
                                 "velocity_error_impulse_m = 0.1"}) {
    const Outcome missing = run_shell("swarmcert " + proved + disturbance_file(folder, body), folder.path());
    EXPECT_EQ(missing.exit_code, 2) << body << missing.output;
    EXPECT_NE(missing.output.find("--position-error P"), std::string::npos) << missing.output;
  }
}

TEST(BoundCommand, ASwarmsBoundContainsTheForceDeclaredBesideItsCouplings) {
  const ScratchFolder folder;
  const std::string position = "[position]\nKp = 10\nKd = 5\n";
  const std::string swarm = " --swarm " + kSourceFolder + "/stability/bounds/swarms/one-way-pair.toml";
  const std::string integrates = "bound" + gains_file(folder, position + "Ki = 10\n") + swarm;
  const Json alone = json_of(folder, integrates)["swarm"];
  EXPECT_EQ(alone["of_force"]["error_m"], 0);
  for (const char* const options : {" --amplitude 0.01", " --rate 0.01", " --edge 0.01"}) {
    const Json forced = json_of(folder, integrates + options)["swarm"];
    const double own_m = forced["of_force"]["error_m"].get<double>();
    EXPECT_GT(own_m, 1e-3) << options;
    for (std::size_t vehicle = 0; vehicle < 2; ++vehicle)
      EXPECT_GE(forced["error_m"][vehicle].get<double>(), alone["error_m"][vehicle].get<double>() + own_m);
  }
  // In the long run the integrator compensates for a constant force.
  EXPECT_EQ(json_of(folder, integrates + " --bias 0.01")["swarm"]["of_force"]["error_m"], 0);
  const Outcome missing = run_shell("swarmcert " + integrates + " --impulse 0.01", folder.path());
  EXPECT_EQ(missing.exit_code, 2) << missing.output;
  EXPECT_NE(missing.output.find("--amplitude E"), std::string::npos) << missing.output;
}

TEST(BoundCommand, TheShippedSwarmsAreProvedInconclusiveAndRefuted) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nKp = 10\nKd = 5\nKi = 10\n");
  const std::string swarms = kSourceFolder + "/stability/bounds/swarms/";
  const Json one_way = json_of(folder, "bound" + gains + " --swarm " + swarms + "one-way-pair.toml")["swarm"];
  EXPECT_EQ(one_way["verdict"], "proved");
  EXPECT_NEAR(one_way["spectral_radius"][1].get<double>(), 0.145 * 4.996850736188977, 1e-9);
  const Outcome pair =
      run_shell("swarmcert bound" + gains + " --swarm " + swarms + "published-pair.toml", folder.path());
  EXPECT_EQ(pair.exit_code, 4) << pair.output;
  EXPECT_NE(pair.output.find("would do"), std::string::npos) << pair.output;
  // With the integral gain used in flight (10 written, 2 effective), the third swarm is unstable, and a simulation
  // shows it.
  const Outcome unstable = run_shell(
      "swarmcert bound" + kFlown + " --swarm " + swarms + "unstable-pair.toml --json u.json", folder.path());
  EXPECT_EQ(unstable.exit_code, 1) << unstable.output;
  const Json refuted = files::parse_json(read_text(folder / "u.json"), "u.json")["swarm"];
  EXPECT_EQ(refuted["verdict"], "refuted");
  EXPECT_GE(refuted["witness"]["error_over_initial"].get<double>(), 1000);
}

}  // namespace
}  // namespace swarmcert::tests

/// study on the command line: flights of a vehicle with effects that the model lacks.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

#include "analysis/commands/add/add_output.h"
#include "analysis/residuals/flown_signals.h"
#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

class Study : public testing::Test {
 protected:
  /// Random walks of two vehicles with downwash, motor lag and drag: flights/1 .. flights/`count`.
  void fly(int count) {
    for (int run = 1; run <= count; ++run) fly(run, run);
  }
  void fly(int run, int seed) {
    fly(source_path("stability/models/crazyflie-small-effects.toml"), 2, 25, run, seed);
  }
  void fly(const std::string& truth, int vehicles, int duration_s, int run, int seed) {
    const Outcome outcome = run_shell(
        fmt::format("swarmcert simulate random-walk -q --vehicles {} --duration {} --seed {} --model {} "
                    "--gains {} -o flights/{}",
                    vehicles, duration_s, seed, truth, source_path("controller/gains/crazyflie-small.toml"),
                    run),
        folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  }
  /// Returns the small Crazyflie with one more effect.
  std::string truth_with(const std::string& effect) {
    write_text(folder_ / "truth.toml",
               read_text(source_path("stability/models/crazyflie-small.toml")) + "\n[[effect]]\n" + effect);
    return folder_ / "truth.toml";
  }

  Outcome study(const std::string& words) {
    return run_shell("swarmcert study " + source_path("stability/models/crazyflie-small.toml") + " " + words,
                     folder_.path());
  }

  files::Json result(const std::string& output) {
    return files::read_json(folder_ / (output + "/study.json"), "swarmcert/study/1");
  }

  const ScratchFolder folder_;
};

TEST_F(Study, ACopyOfALogIsNoFurtherFlightAndCannotBeHeldOut) {
  fly(1);
  for (const char* const name : {"second", "third"})
    std::filesystem::copy(folder_ / "flights/1", folder_ / name, std::filesystem::copy_options::recursive);
  const std::string model = source_path("stability/models/crazyflie-small.toml");
  const auto compare = [&](const std::string& flights) {
    const Outcome outcome =
        run_shell("swarmcert compare " + model + " " + flights + " --force -q --json c.json", folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return files::read_json(folder_ / "c.json", "swarmcert/compare/1");
  };
  const files::Json one = compare("flights"), three = compare("flights second third");
  EXPECT_EQ(three["overall"], one["overall"]);
  EXPECT_EQ(three["left_out"].size(), one["flights"].size() * 2) << three["left_out"].dump();
  const Outcome held_out = study("flights --select second --test third -o out -q");
  EXPECT_EQ(held_out.exit_code, 2);
  EXPECT_NE(held_out.output.find("would not be held out"), std::string::npos) << held_out.output;
  const Outcome against = study("flights --against second -o out -q");
  EXPECT_EQ(against.exit_code, 2);
  EXPECT_NE(against.output.find("on both sides"), std::string::npos) << against.output;
}

TEST_F(Study, AddsWhatIsMissingAndLowersTheErrorOfTestFlights) {
  fly(3);
  const Outcome outcome = study("flights -o out -q --json copy.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json json = result("out");
  EXPECT_EQ(json["verdict"], "missing_effect");
  EXPECT_EQ(json["ranking"][0]["effect"], "downwash");
  EXPECT_LT(json["after"]["test"]["rmse"]["z"].get<double>(),
            0.5 * json["before"]["test"]["rmse"]["z"].get<double>());
  for (const char* const key : {"ladder", "remainder", "next"}) EXPECT_TRUE(json[key].is_array()) << key;
  EXPECT_EQ(read_text(folder_ / "copy.json"), read_text(folder_ / "out/study.json"));
  EXPECT_NE(outcome.output.find("Error of the force (RMS) on flights that nothing was fitted to: "),
            std::string::npos)
      << outcome.output;
  // The fitted model reproduces the error stated on the page.
  EXPECT_EQ(
      run_shell("swarmcert compare out/fitted.toml flights -q --json after.json", folder_.path()).exit_code,
      0);
  EXPECT_EQ(files::read_json(folder_ / "after.json", "swarmcert/compare/1")["overall"]["rmse"]["z"],
            json["after"]["all"]["rmse"]["z"]);
  const std::string page = read_text(folder_ / "out/study.html");
  for (const char* const shown :
       {"Where the model failed", "id=\"flown-data\"", "with all of their records", "held out",
        "Effect motor_lag: its force over thrust rate", "Effect drag_linear: its force over v",
        "Effect downwash: its force over lateral distance to a vehicle above"})
    EXPECT_NE(page.find(shown), std::string::npos) << shown;
  EXPECT_EQ(study("flights -o out -q").exit_code, 3) << "a folder that is not empty is kept";
}

TEST_F(Study, EndsWithCausesTheirSizeAndACommandThatRuns) {
  fly(3);
  const Outcome outcome = study("flights -o out -q");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json json = result("out");
  EXPECT_EQ(json["held_out"]["how"], "flights");
  EXPECT_EQ(json["held_out"]["records"], json["after"]["test"]["records"]);
  ASSERT_FALSE(json["causes"].empty());
  double rmse_N = json["before"]["test"]["rmse"]["total"];
  for (const files::Json& cause : json["causes"]) {
    EXPECT_FALSE(cause["equation"].get<std::string>().empty()) << cause;
    EXPECT_FALSE(cause["parameters"].empty()) << cause;
    rmse_N *= 1 - cause["fall_percent"].get<double>() / 100;
  }
  // The falls multiply to the whole fall of the error of the vector.
  EXPECT_NEAR(rmse_N, json["after"]["test"]["rmse"]["total"].get<double>(), 1e-6);
  const std::string next = json["next_command"];
  EXPECT_NE(outcome.output.find("Next: " + next), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("rotors that follow their commands with a lag of"), std::string::npos)
      << outcome.output;
  EXPECT_EQ(outcome.output.find("fly to see"), std::string::npos)
      << "nothing is left to explain" << outcome.output;
  const Outcome ran = run_shell(next, folder_.path());
  EXPECT_EQ(ran.exit_code, 0) << next << "\n" << ran.output;
}

TEST_F(Study, SaysWhereAnUpdraftIsInWordsAndOnAMap) {
  const std::string truth = truth_with(
      "name = \"wind_field\"\nparameters = { thermal_N = 0.06, x_m = -0.1, y_m = 0.08, radius_m = 0.06 }\n");
  for (int run = 1; run <= 3; ++run) fly(truth, 1, 30, run, run);
  const Outcome outcome = study("flights -o out -q");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(result("out")["fails"]["where"], "region");
  for (const char* const words : {"It fails at x ", "mN towards +z", "Mean residual along z [mN]",
                                  "y [m] \\ x", "wind_field: an updraft of ", "nothing else stands out"})
    EXPECT_NE(outcome.output.find(words), std::string::npos) << words << "\n" << outcome.output;
}

TEST_F(Study, GoesOnWithAFormulaWhereNoNamedEffectExplainsTheForce) {
  const std::string truth = truth_with(
      "name = \"updraft\"\nparameters = { a = 0.04, r = 0.3 }\n[effect.expression]\n"
      "force_z_N = \"a * exp(-((x - 0.4)^2 + (y + 0.3)^2) / (2 * r^2))\"\nlinear = [\"a\"]\n");
  for (int run = 1; run <= 5; ++run) fly(truth, 1, 30, run, run);
  const Outcome outcome = study("flights -o out -q");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json json = result("out");
  ASSERT_FALSE(json["causes"].empty()) << outcome.output;
  EXPECT_LT(json["after"]["test"]["rmse"]["total"].get<double>(),
            0.7 * json["before"]["test"]["rmse"]["total"].get<double>())
      << outcome.output;
  EXPECT_LT(json["ladder"].back()["over_noise_floor"].get<double>(), 1.2) << outcome.output;
  EXPECT_FALSE(json["stopped"].get<std::string>().empty());
}

TEST_F(Study, ASidewaysForceIsNamedWithItsAxisAndIsTheSameEverywhere) {
  const std::string truth = truth_with("name = \"constant_force\"\nparameters = { force_y_N = -0.02 }\n");
  for (int run = 1; run <= 3; ++run) fly(truth, 1, 25, run, run);
  const Outcome outcome = study("flights -o out -q");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json json = result("out");
  EXPECT_EQ(json["fails"]["where"], "everywhere") << json["fails"];
  EXPECT_NE(json["fails"]["words"].get<std::string>().find("towards -y"), std::string::npos) << json["fails"];
  EXPECT_NE(outcome.output.find("most along y"), std::string::npos) << outcome.output;
  ASSERT_FALSE(json["causes"].empty()) << outcome.output;
  EXPECT_EQ(json["causes"][0]["name"], "constant_force");
  EXPECT_GT(json["causes"][0]["fall_percent"].get<double>(), 50);
}

TEST_F(Study, OneLogIsHeldOutByPartsAndAShortOneNotAtAll) {
  fly(source_path("stability/models/crazyflie-small-effects.toml"), 2, 60, 1, 1);
  ASSERT_EQ(study("flights -o long -q").exit_code, 0);
  const files::Json json = result("long");
  EXPECT_EQ(json["held_out"]["how"], "parts of flights");
  EXPECT_GT(json["held_out"]["records"].get<int>(), 0);
  EXPECT_LT(json["held_out"]["records"].get<int>(), json["before"]["all"]["records"].get<int>() / 3);
  std::set<std::string> parts;
  for (const char* const use : {"fit", "select", "test"})
    for (const files::Json& name : json["split"][use]) parts.insert(name.get<std::string>());
  EXPECT_EQ(parts.size(), 5U) << json["split"];
  EXPECT_LT(json["after"]["test"]["rmse"]["total"].get<double>(),
            json["before"]["test"]["rmse"]["total"].get<double>());
  std::filesystem::remove_all(folder_ / "flights");
  fly(1);
  ASSERT_EQ(study("flights -o short -q").exit_code, 0);
  const files::Json alone = result("short");
  EXPECT_EQ(alone["held_out"]["how"], "nothing");
  EXPECT_EQ(alone["held_out"]["records"], 0);
  for (const files::Json& row : alone["ladder"]) EXPECT_TRUE(row["test_rmse"].is_null()) << row;
}

TEST_F(Study, FlightsThatAreNamedForTheTestDecideNothing) {
  fly(4);
  const std::string words = "flights/1 flights/2 --select flights/3 -q --force ";
  ASSERT_EQ(study(words + "--test flights/4 -o one").exit_code, 0);
  const std::string log = folder_ / "flights/4/cf1_00";
  ASSERT_TRUE(std::filesystem::exists(log));
  std::filesystem::remove_all(folder_.path() / "flights/4");
  fly(4, 5);
  ASSERT_EQ(study(words + "--test flights/4 -o two").exit_code, 0);
  const files::Json one = result("one"), two = result("two");
  EXPECT_EQ(one["effects"], two["effects"]);
  EXPECT_EQ(one["ranking"], two["ranking"]);
  EXPECT_NE(one["after"]["test"], two["after"]["test"]);
  EXPECT_EQ(one["split"]["test"].size(), 1U);
}

TEST_F(Study, SaysWhatChangedAgainstOtherFlights) {
  for (int run = 1; run <= 3; ++run) {
    for (const auto& [when, model] :
         {std::pair("before", "crazyflie-small"), {"now", "crazyflie-small-effects"}}) {
      const Outcome outcome =
          run_shell(fmt::format("swarmcert simulate random-walk -q --duration 25 --seed {0}{1} --model {2} "
                                "--gains {3} -o {4}/{0}",
                                run, std::string(when) == "now" ? 1 : 0,
                                source_path(fmt::format("stability/models/{}.toml", model)),
                                source_path("controller/gains/crazyflie-small.toml"), when),
                    folder_.path());
      ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    }
  }
  const Outcome outcome = study("now --against before -o out");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json json = result("out");
  // In flights of a single vehicle the second model differs by motor lag and drag; these setpoints are too slow to
  // show a lag.
  EXPECT_EQ(json["changed"]["verdict"], "missing_effect");
  std::set<std::string> changed;
  for (const files::Json& entry : json["changed"]["ranking"])
    changed.insert(entry["effect"].get<std::string>());
  EXPECT_EQ(changed.count("drag_linear"), 1U) << json["changed"]["ranking"].dump(1);
  EXPECT_EQ(json["against"]["flights"].size(), 3U);
  EXPECT_NE(outcome.output.find("Against the other flights, cf1: "), std::string::npos) << outcome.output;
  EXPECT_NE(read_text(folder_ / "out/study.html").find("What changed against the other flights"),
            std::string::npos);
  EXPECT_EQ(study("now --against now/1 -o other").exit_code, 2) << "a flight is not held against itself";
}

TEST_F(Study, EveryPageShowsForcesInTheOneUnitThatIsAsked) {
  fly(2);
  const std::string model = source_path("stability/models/crazyflie-small.toml");
  struct Page {
    std::string command, option, shown;
  };
  for (const Page& page :
       {Page{"compare " + model + " flights", "N", "[mN]"},
        {"compare " + model + " flights", "m_s2", "[m/s^2]"},
        {"diagnose " + model + " flights", "gf", "[gf]"},
        {"add drag_linear --model " + model + " flights -o fitted.toml", "m_s2", "[m/s^2]"}}) {
    const Outcome outcome = run_shell(
        "swarmcert " + page.command + " -q --force --report page --unit " + page.option, folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    const std::string asked = page.shown.substr(1, page.shown.size() - 2);
    EXPECT_NE(outcome.output.find(asked), std::string::npos) << page.command << "\n" << outcome.output;
    for (const std::string unit : {"mN", "gf", "N", "m/s^2"})
      EXPECT_TRUE(unit == asked || (outcome.output.find(" " + unit + " ") == std::string::npos &&
                                    outcome.output.find("[" + unit) == std::string::npos))
          << page.command << " also speaks of " << unit << "\n"
          << outcome.output;
    const std::string text = read_text(folder_ / "page/report.html");
    for (const char* const unit : {"[mN]", "[gf]", "[N]", "[m/s^2]"})
      EXPECT_EQ(text.find(unit) != std::string::npos, unit == page.shown) << page.command << " and " << unit;
  }
}

TEST(LadderTable, HasADashWhereNothingIsHeldOut) {
  stability::LadderRow row;
  row.effect = "nominal";
  row.fit_rmse_N = row.select_rmse_N = 0.0123;
  const analysis::Table table = analysis::ladder_table({row}, {"mN", 1e-3});
  EXPECT_EQ(table.header[1], "fit [mN]");
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"nominal", "12.30", "12.30", "-", "-"}));
}

TEST_F(Study, EveryCommandOfAWalkEndsWithTheNextOne) {
  fly(1);
  const std::string net = source_path("nn/networks/demo/network.toml"),
                    model = source_path("stability/models/crazyflie-small.toml"),
                    gains = source_path("controller/gains/crazyflie-small.toml");
  for (const std::string& words :
       {"simulate hover --model " + model + " --gains " + gains + " --duration 2 -o hover",
        std::string("inspect flights/1/cf1_00"), std::string("model draft flights -o model.toml"),
        "compare " + model + " flights", "diagnose " + model + " flights",
        "add drag_linear --model " + model + " flights -o fitted.toml",
        "bound --gains " + gains + " --model " + model,
        "spacing --max-error 0.1 --steps 3 --gains " + gains + " --model " + model,
        "tune --nodes 50 --gains " + gains + " --model " + model,
        "iss-check --runs 5 --gains " + gains + " --model " + model, std::string("demo -o shown"),
        "certify " + net + " --method product --nodes 1 -o cert.json", "check cert.json " + net,
        "export " + net + " --certificate cert.json -o firmware", "match " + net + " firmware"}) {
    const Outcome outcome = run_shell("swarmcert " + words + " -q", folder_.path());
    EXPECT_NE(outcome.exit_code, 2) << outcome.output;
    EXPECT_NE(outcome.output.find("Next: swarmcert "), std::string::npos) << words << "\n" << outcome.output;
  }
}

TEST_F(Study, APageHoldsNoSignalsOfTheLogsIfItIsToldSo) {
  fly(1);
  const std::string compare =
      "swarmcert compare " + source_path("stability/models/crazyflie-small.toml") + " flights -q --report ";
  ASSERT_EQ(run_shell(compare + "with", folder_.path()).exit_code, 0);
  ASSERT_EQ(run_shell(compare + "without --no-embed", folder_.path()).exit_code, 0);
  const std::string with = read_text(folder_ / "with/report.html"),
                    without = read_text(folder_ / "without/report.html");
  EXPECT_NE(with.find("id=\"flown-data\""), std::string::npos);
  for (const char* const signal :
       {"\"set point velocity\"", "\"motor command\"", "\"battery\"", "\"attitude\""})
    EXPECT_NE(with.find(signal), std::string::npos) << signal;
  EXPECT_EQ(without.find("id=\"flown-data\""), std::string::npos);
  EXPECT_NE(without.find("This page holds no signals of the logs."), std::string::npos);
  EXPECT_LT(without.size(), with.size() / 2);
}

TEST_F(Study, ThinnedSignalsKeepTheirExtremesAndAllThatIsAroundAWorstMoment) {
  fly(source_path("stability/models/crazyflie-small-effects.toml"), 1, 400, 1, 1);
  residuals::InputArguments arguments;
  arguments.models = {source_path("stability/models/crazyflie-small.toml")};
  arguments.flights = {folder_ / "flights"};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  std::vector<std::string> problems;
  const residuals::Track track = inputs.load(0, problems)[0];
  residuals::Moment worst;
  worst.path = track.path;
  worst.time_s = 200;
  const std::vector<residuals::FlownFlight> flights = residuals::flown_signals(inputs, nullptr, {worst});
  ASSERT_EQ(flights.size(), 1U);
  const residuals::FlownVehicle& vehicle = flights[0].vehicles[0];
  EXPECT_EQ(vehicle.records, track.instants.size());
  EXPECT_LT(vehicle.rows.size(), vehicle.records * 9 / 10);
  constexpr std::size_t kThrust = 19;
  float least = INFINITY, most = -INFINITY;
  std::size_t around = 0, all_around = 0;
  for (const residuals::FlownRow& row : vehicle.rows) {
    least = std::min(least, row[kThrust]);
    most = std::max(most, row[kThrust]);
    around += std::abs(row[0] - 200) < 1.9F ? 1 : 0;
  }
  float true_least = INFINITY, true_most = -INFINITY;
  for (const stability::Instant& now : track.instants) {
    true_least = std::min(true_least, static_cast<float>(now.thrust_N));
    true_most = std::max(true_most, static_cast<float>(now.thrust_N));
    all_around += std::abs(static_cast<float>(now.time_s) - 200) < 1.9F ? 1 : 0;
  }
  EXPECT_EQ(least, true_least);
  EXPECT_EQ(most, true_most);
  EXPECT_EQ(around, all_around);
}

TEST_F(Study, APageOfAnHourStaysSmallAndSaysThatItIsThinned_slow) {
  fly(source_path("stability/models/crazyflie-small-effects.toml"), 1, 3600, 1, 1);
  const Outcome outcome =
      run_shell("swarmcert compare " + source_path("stability/models/crazyflie-small.toml") +
                    " flights -q --report page",
                folder_.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const std::string page = read_text(folder_ / "page/report.html");
  EXPECT_LT(page.size(), 5'000'000U);
  EXPECT_NE(page.find("complete only around the worst moments"), std::string::npos);
}

TEST_F(Study, WordsThatMakeNoSenseAreExplained) {
  fly(1);
  EXPECT_EQ(study("flights -o out --test flights").exit_code, 2);
  EXPECT_EQ(study("flights -o out --unit lbf").exit_code, 2);
  EXPECT_EQ(study("nowhere -o out").exit_code, 3);
  std::string ground = "t,px,py,pz,vx,vy,vz,qx,qy,qz,qw,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 500; ++k)
    ground += fmt::format("{:.2f},0.1,0,0.05,0,0,0,0,0,0,1,0,0,0,0,4.1\n", 0.01 * k);
  write_text(folder_ / "ground.csv", ground);
  const Outcome nothing = study("ground.csv -o nothing");
  EXPECT_EQ(nothing.exit_code, 4);
  EXPECT_NE(nothing.output.find("No record of these flights can be judged: "), std::string::npos)
      << nothing.output;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "nothing/study.html")) << "the page says the same";
}

TEST_F(Study, AddsTheThrustRatioThatDiagnoseNamesOfAWholeCollection_slow) {
  SWARMCERT_NEEDS_DATA();
  // Most of these flights have upgraded motors and some carry a payload, so a thrust scale leads the ranking.
  const Outcome outcome = run_shell(
      "swarmcert add auto -q --model " + source_path("stability/models/crazyflie-small.toml") + " " +
          data_path("collections/crazyswarm2-tools/logs") + " -o fitted.toml --json added.json",
      folder_.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json json = files::read_json(folder_ / "added.json", "swarmcert/add/1");
  ASSERT_GE(json["ladder"].size(), 2U);
  EXPECT_EQ(json["ladder"][1]["effect"], "thrust_ratio");
  EXPECT_TRUE(json["ladder"][1]["accepted"].get<bool>());
}

TEST(Demo, CertifiesANetworkAndFindsWhatAModelLacks) {
  const ScratchFolder folder;
  const Outcome outcome = run_shell("swarmcert demo -q -o demo --json demo.json", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const files::Json json = files::read_json(folder / "demo.json", "swarmcert/demo/1");
  EXPECT_EQ(json["accepted"], true);
  const files::Json study = files::read_json(folder / "demo/study/study.json", "swarmcert/study/1");
  EXPECT_EQ(json["study"]["verdict"], study["verdict"]);
  // The three effects of crazyflie-small-effects.toml, which the studied model lacks.
  std::set<std::string> added;
  for (const files::Json& effect : study["effects"]) added.insert(effect["effect"].get<std::string>());
  EXPECT_EQ(added, (std::set<std::string>{"downwash", "motor_lag", "drag_linear"}));
  for (const char* const page : {"demo/report/report.html", "demo/study/study.html"})
    EXPECT_TRUE(std::filesystem::exists(folder / page)) << page;
  EXPECT_EQ(run_shell("swarmcert demo -q -o demo", folder.path()).exit_code, 3) << "results are kept";
}

}  // namespace
}  // namespace swarmcert::tests

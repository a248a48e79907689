/// study on the command line: flights of a vehicle with effects that the model lacks.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

class Study : public testing::Test {
 protected:
  /// Random walks of two vehicles with downwash, motor lag and drag: flights/1 .. flights/`count`.
  void fly(int count) {
    for (int run = 1; run <= count; ++run) {
      const Outcome outcome = run_shell(
          fmt::format("swarmcert simulate random-walk -q --vehicles 2 --duration 25 --seed {0} --model {1} "
                      "--gains {2} -o flights/{0}",
                      run, source_path("stability/models/crazyflie-small-effects.toml"),
                      source_path("controller/gains/crazyflie-small.toml")),
          folder_.path());
      ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    }
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
  EXPECT_NE(outcome.output.find("Vertical error (RMS) on test flights"), std::string::npos) << outcome.output;
  // The fitted model reproduces the error that the page states.
  EXPECT_EQ(
      run_shell("swarmcert compare out/fitted.toml flights -q --json after.json", folder_.path()).exit_code,
      0);
  EXPECT_EQ(files::read_json(folder_ / "after.json", "swarmcert/compare/1")["overall"]["rmse"]["z"],
            json["after"]["all"]["rmse"]["z"]);
  EXPECT_NE(read_text(folder_ / "out/study.html").find("Where the model failed"), std::string::npos);
  EXPECT_EQ(study("flights -o out -q").exit_code, 3) << "a folder that is not empty is kept";
}

TEST_F(Study, FlightsThatAreNamedForTheTestDecideNothing) {
  fly(4);
  const std::string words = "flights/1 flights/2 --select flights/3 -q --force ";
  ASSERT_EQ(study(words + "--test flights/4 -o one").exit_code, 0);
  const std::string log = folder_ / "flights/4/cf1_00";
  ASSERT_TRUE(std::filesystem::exists(log));
  std::filesystem::remove_all(folder_.path() / "flights/4");
  std::filesystem::copy(folder_.path() / "flights/1", folder_.path() / "flights/4");
  ASSERT_EQ(study(words + "--test flights/4 -o two").exit_code, 0);
  const files::Json one = result("one"), two = result("two");
  EXPECT_EQ(one["effects"], two["effects"]);
  EXPECT_EQ(one["ranking"], two["ranking"]);
  EXPECT_NE(one["after"]["test"], two["after"]["test"]);
  EXPECT_EQ(one["split"]["test"].size(), 1U);
}

TEST_F(Study, WordsThatMakeNoSenseAreExplained) {
  fly(1);
  EXPECT_EQ(study("flights -o out --test flights").exit_code, 2);
  EXPECT_EQ(study("flights -o out --unit lbf").exit_code, 2);
  EXPECT_EQ(study("nowhere -o out").exit_code, 3);
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

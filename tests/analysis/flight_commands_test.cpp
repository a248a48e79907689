/// compare, diagnose and add on the command line: too little data, invalid arguments, injected effects, reports.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

std::string small_model() { return source_path("stability/models/crazyflie-small.toml"); }

/// Random walks of one vehicle without a hidden effect.
void fly(const ScratchFolder& folder, int duration_s, const std::string& into) {
  const Outcome outcome = run_shell(
      fmt::format("swarmcert simulate random-walk -q --duration {} --seed 4 --model {} --gains {} -o {}",
                  duration_s, small_model(), source_path("controller/gains/crazyflie-small.toml"), into),
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
}

files::Json result_of(const ScratchFolder& folder, const std::string& command, const std::string& schema) {
  const Outcome outcome = run_shell("swarmcert " + command + " -q --force --json r.json", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << command << "\n" << outcome.output;
  return files::read_json(folder / "r.json", "swarmcert/" + schema + "/1");
}

TEST(FlightCommands, SayWhyAFewSecondsGiveNoAnswer) {
  const ScratchFolder folder;
  fly(folder, 6, "flights");
  for (const std::string& command :
       {"diagnose " + small_model() + " flights",
        "add auto --model " + small_model() + " flights -o new.toml",
        "add drag_linear --keep-anyway --model " + small_model() + " flights -o new.toml"}) {
    const Outcome outcome = run_shell("swarmcert " + command + " -q --force --json r.json", folder.path());
    EXPECT_EQ(outcome.exit_code, 4) << command << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find("at least 10 blocks"), std::string::npos) << outcome.output;
    EXPECT_NE(read_text(folder / "r.json").find("\"reason\""), std::string::npos);
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "new.toml"));
}

TEST(FlightCommands, CompareShowsNoErrorsWhereNothingWasCompared) {
  const ScratchFolder folder;
  ASSERT_EQ(run_shell(": > cf1_00", folder.path()).exit_code, 0);
  const Outcome outcome = run_shell("swarmcert compare " + small_model() + " cf1_00", folder.path());
  EXPECT_EQ(outcome.exit_code, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("nothing was compared: cf1_00: offset 0: the file is empty"),
            std::string::npos)
      << outcome.output;
  EXPECT_EQ(outcome.output.find("Next: "), std::string::npos) << outcome.output;
  EXPECT_EQ(outcome.output.find("RMSE"), std::string::npos) << outcome.output;
}

TEST(FlightCommands, RefuseKindsThatNobodyHasAndSuggestNamesOfEffects) {
  const ScratchFolder folder;
  fly(folder, 6, "flights");
  const std::string gains = source_path("controller/gains/crazyflie-small.toml");
  const Outcome kind =
      run_shell("swarmcert compare " + small_model() + " flights --gains smal=" + gains, folder.path());
  EXPECT_EQ(kind.exit_code, 2) << kind.output;
  EXPECT_NE(kind.output.find("did you mean \"small\""), std::string::npos) << kind.output;
  const Outcome effect =
      run_shell("swarmcert add torque_bais --model " + small_model() + " flights -o new.toml", folder.path());
  EXPECT_EQ(effect.exit_code, 2) << effect.output;
  EXPECT_NE(effect.output.find("did you mean \"torque_bias\""), std::string::npos) << effect.output;
}

TEST(FlightCommands, RefuseToInjectTwoLogsIntoOneFile) {
  const ScratchFolder folder;
  fly(folder, 4, "one/flights");
  fly(folder, 5, "two/flights");
  const Outcome outcome =
      run_shell("swarmcert compare " + small_model() + " one two --inject injected --force", folder.path());
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_NE(outcome.output.find("to the same place"), std::string::npos) << outcome.output;
  EXPECT_FALSE(std::filesystem::exists(folder / "injected"));
}

/// One good log, one with a damaged line, one empty log.
TEST(FlightCommands, WarnOfLogsThatAreDamagedOrCannotBeRead) {
  const ScratchFolder folder;
  fly(folder, 40, "flights");
  std::string bytes = read_text(folder / "flights/cf1_00");
  bytes[bytes.size() / 2] ^= 1;
  write_text(folder / "flights/cf1_01", bytes);
  write_text(folder / "flights/cf1_02", "");
  for (const char* command : {"diagnose", "compare"}) {
    SCOPED_TRACE(command);
    const Outcome outcome =
        run_shell(std::string("swarmcert ") + command + " " + small_model() + " flights -q", folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("cf1_01: 1 damaged place"), std::string::npos) << outcome.output;
    EXPECT_NE(outcome.output.find("cf1_02: offset 0: the file is empty"), std::string::npos)
        << outcome.output;
  }
}

TEST(FlightCommands, InjectAnEffectThatDiagnoseFindsAndAddTakesOutAgain) {
  const ScratchFolder folder;
  fly(folder, 40, "flights");
  write_text(folder / "truth.toml", read_text(small_model()) +
                                        "\n[[effect]]\nname = \"drag_linear\"\nparameters = { drag_N_s_m = "
                                        "0.03 }\n");
  const double before =
      result_of(folder, "compare " + small_model() + " flights", "compare")["overall"]["rmse"]["total"];
  const files::Json written = result_of(folder, "compare truth.toml flights --inject injected", "compare");
  EXPECT_EQ(written["injected"]["logs"].size(), 1u);
  ASSERT_TRUE(std::filesystem::exists(folder / "injected/flights/cf1_00"));
  EXPECT_EQ(run_shell("swarmcert compare truth.toml flights --inject injected", folder.path()).exit_code, 3)
      << "nothing is overwritten";
  const files::Json ranking =
      result_of(folder, "diagnose " + small_model() + " injected --report report", "diagnose")["ranking"];
  // The flight itself has the motor lag that its gains assume.
  const auto drag = std::find_if(ranking.begin(), ranking.end(),
                                 [](const files::Json& entry) { return entry["effect"] == "drag_linear"; });
  ASSERT_NE(drag, ranking.end()) << ranking.dump(1);
  EXPECT_NEAR((*drag)["parameters"]["drag_N_s_m"]["value"].get<double>(), 0.03, 0.003);
  EXPECT_NE(read_text(folder / "report/report.html").find("drag_linear"), std::string::npos);
  EXPECT_NE(read_text(folder / "report/ranking_1.dat").find("drag_linear"), std::string::npos);
  // The model removes exactly what was injected: the residual is unchanged up to the rounding of the log.
  const double after =
      result_of(folder, "compare truth.toml injected", "compare")["overall"]["rmse"]["total"];
  EXPECT_NEAR(after, before, 0.002 * before);
}

}  // namespace
}  // namespace swarmcert::tests

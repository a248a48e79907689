// iss-check, spacing, sweep, merge and tune as a user runs them.
#include <gtest/gtest.h>

#include "analysis/tracking_runs.h"

namespace swarmcert::tests {
namespace {

using files::Json;

TEST(IssCheckCommand, WithoutAViolationAndWithoutTheTheoremItIsInconclusive) {
  // With a delay the theorem does not apply, and the integrated loop has no delay: nothing is violated, and nothing
  // is shown.
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nLambda = 4\nK = 0.136\n[lag]\ndelay_s = 0.01\n");
  const Outcome outcome =
      run_shell("swarmcert iss-check" + gains + " --runs 10 --json out.json", folder.path());
  EXPECT_EQ(outcome.exit_code, 4) << outcome.output;
  const Json result = files::parse_json(read_text(folder / "out.json"), "out.json");
  EXPECT_EQ(result["verdict"], "inconclusive");
  EXPECT_FALSE(result["theorem"]["applies"].get<bool>());
  EXPECT_FALSE(result["theorem"]["why_not"].empty());
  EXPECT_EQ(result["violations"], 0);
  EXPECT_EQ(result["delay_left_out_s"], 0.01);
}

TEST(IssCheckCommand, ARunOutsideTheHypothesesEndsTheCampaignInconclusiveAndNotInAFault) {
  // At 0.1 N/s one run drives the commanded force through zero, where the full loop cannot be integrated; at 0.3 N/s
  // the thrust saturates or the vehicle tips over after about a second.
  const ScratchFolder folder;
  const std::string gains = " --gains " + kSourceFolder + "/controller/gains/composite.toml" + kModel;
  for (const char* const rate : {"0.1", "0.3", "1e308"}) {
    const Outcome outcome = run_shell(
        "swarmcert iss-check" + gains + " --runs 20 --force --json out.json --rate " + rate, folder.path());
    EXPECT_EQ(outcome.exit_code, 4) << rate << outcome.output;
    const Json result = files::parse_json(read_text(folder / "out.json"), "out.json");
    EXPECT_EQ(result["verdict"], "inconclusive");
    EXPECT_TRUE(result["theorem"]["applies"].get<bool>());
    EXPECT_EQ(result["violations"], 0);
    EXPECT_GT(result["left_hypotheses"].get<int>(), 0);
    ASSERT_FALSE(result["why_inconclusive"].empty());
    EXPECT_NE(result["why_inconclusive"][0].get<std::string>().find(", first after "), std::string::npos);
  }
}

TEST(SpacingCommand, FartherNeedsNoMoreSpeedAndAGuardNeedsMore) {
  const ScratchFolder folder;
  const Json plain = json_of(folder, "spacing" + kFlown + " --max-error 0.1");
  const Json guarded = json_of(folder, "spacing" + kFlown + " --max-error 0.1 --guard 1.35");
  ASSERT_EQ(plain["shape"].size(), guarded["shape"].size());
  int crossings = 0;
  for (std::size_t i = 0; i < plain["shape"].size(); ++i) {
    const Json& a = plain["shape"][i];
    const Json& b = guarded["shape"][i];
    EXPECT_LE(a["keep_out_radius_m"].get<double>(), b["keep_out_radius_m"].get<double>());
    if (!a["may_cross"].get<bool>() || !b["may_cross"].get<bool>()) continue;
    ++crossings;
    EXPECT_LE(a["least_speed_m_s"].get<double>(), b["least_speed_m_s"].get<double>());
  }
  EXPECT_GT(crossings, 3);
}

void write_grid(const ScratchFolder& folder) {
  write_text(folder / "gains.toml",
             "schema = \"swarmcert/gains/1\"\n[position]\nKp = 10\nKd = 5\nKi = 10\nrate_hz = 500\n[lag]\n"
             "motor_s = 0.0575\n");
  write_text(folder / "grid.toml",
             "schema = \"swarmcert/grid/1\"\ngains = \"gains.toml\"\nmodel = \"" + kSourceFolder +
                 "/stability/models/crazyflie-small.toml\"\naxis = \"z\"\n"
                 "compute = [\"amplitude\", \"impulse\", \"noise_command_m_s2\", \"lag_limit_s\"]\n"
                 "pareto = [\"impulse\", \"noise_command_m_s2\", \"lag_limit_s\"]\n"
                 "[axes]\nKp = {from = 2, to = 40, steps = 17, scale = \"log\"}\n"
                 "Kd = {from = 0.5, to = 20, steps = 13, scale = \"log\"}\n"
                 "mass_kg = {from = 0.03, to = 0.04, steps = 2}\n");
}

TEST(SweepCommand, ShardsMergeToTheBytesOfAnUndividedRun) {
  const ScratchFolder folder;
  write_grid(folder);
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o whole", folder.path()).exit_code, 0);
  for (int i = 1; i <= 3; ++i) {
    ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o parts -j 1 --shard " + std::to_string(i) + "/3",
                        folder.path())
                  .exit_code,
              0);
    if (i < 3) {
      const Outcome early = run_shell("swarmcert merge parts", folder.path());
      EXPECT_EQ(early.exit_code, 3);
      EXPECT_NE(early.output.find("are missing"), std::string::npos) << early.output;
    }
  }
  const Outcome part = run_shell("swarmcert sweep grid.toml -o parts --shard 1/3 --resume", folder.path());
  EXPECT_NE(part.output.find("Next: swarmcert merge parts"), std::string::npos) << part.output;
  EXPECT_EQ(json_of(folder, "merge parts")["inputs"].size(), 3u);
  const Outcome merged = run_shell("swarmcert merge parts --force", folder.path());
  EXPECT_NE(merged.output.find("Next: swarmcert tune --gains gains.toml"), std::string::npos)
      << merged.output;
  EXPECT_EQ(read_text(folder / "whole/sweep.json"), read_text(folder / "parts/sweep.json"));
  EXPECT_EQ(read_text(folder / "whole/report/report.html"), read_text(folder / "parts/report/report.html"));
  const Json points = files::parse_json(read_text(folder / "whole/sweep.json"), "sweep.json")["points"];
  ASSERT_EQ(points.size(), 17u * 13 * 2);
  int infeasible = 0;
  int on_front = 0;
  for (const Json& point : points) {
    if (!point["feasible"].get<bool>()) {
      ++infeasible;
      EXPECT_FALSE(point["reason"].get<std::string>().empty());
    }
    on_front += point["pareto"].get<bool>();
  }
  EXPECT_GT(infeasible, 5);
  EXPECT_GT(on_front, 5);
}

TEST(SweepCommand, AnExistingShardIsKeptUnlessToldOtherwise) {
  const ScratchFolder folder;
  write_grid(folder);
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o parts --shard 0/4", folder.path()).exit_code, 0);
  EXPECT_EQ(run_shell("swarmcert sweep grid.toml -o parts --shard 0/4", folder.path()).exit_code, 3);
  EXPECT_EQ(run_shell("swarmcert sweep grid.toml -o parts --shard 0/4 --resume", folder.path()).exit_code, 0);
  EXPECT_EQ(run_shell("swarmcert sweep grid.toml -o parts --shard 5/4", folder.path()).exit_code, 2);
  // A shard of another partition of the same grid contains cells twice.
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o parts --shard 0/2", folder.path()).exit_code, 0);
  const Outcome twice = run_shell("swarmcert merge parts", folder.path());
  EXPECT_EQ(twice.exit_code, 3);
  EXPECT_NE(twice.output.find("a cell of two shards"), std::string::npos) << twice.output;
}

TEST(SweepCommand, AxesAndLimitsThatCannotBeMeantAreRefused) {
  const ScratchFolder folder;
  write_grid(folder);
  const std::string grid = read_text(folder / "grid.toml");
  for (const auto& [more, words] :
       {std::pair("vehicles = {from = 1, to = 4, steps = 3}\n",
                  "axes.vehicles.steps = 3: gives 2.5 vehicles"),
        std::pair("Ki = {from = -2, to = 4, steps = 3}\n", "axes.Ki.from = -2: must not be negative"),
        std::pair("Ki = {from = 0, to = 4, steps = 3, scale = \"log\"}\n",
                  "from = 0: must be positive on a log"),
        std::pair("motor_s = {from = 0, to = 57, steps = 3}\n", "axes.motor_s.to = 57: is longer than 1 s"),
        std::pair("[limits.impulse]\nleast = 6\nmost = 5\n",
                  "limits.impulse.least = 6: is more than most = 5")}) {
    write_text(folder / "grid.toml", grid + more);
    const Outcome outcome = run_shell("swarmcert sweep grid.toml -o out", folder.path());
    EXPECT_EQ(outcome.exit_code, 3);
    EXPECT_NE(outcome.output.find(words), std::string::npos) << outcome.output << "\nlacks: " << words;
  }
}

TEST(SweepCommand, AFolderWithOtherThingsIsLeftAlone) {
  const ScratchFolder folder;
  write_grid(folder);
  std::filesystem::create_directory(folder / "photos");
  write_text(folder / "photos/holiday.txt", "not of a sweep");
  EXPECT_EQ(run_shell("swarmcert sweep grid.toml -o photos -q", folder.path()).exit_code, 3);
  EXPECT_FALSE(std::filesystem::exists(folder / "photos/sweep.json"));
  EXPECT_EQ(run_shell("swarmcert sweep grid.toml -o photos -q --force", folder.path()).exit_code, 0);
}

/// The variables are those set by Slurm; the array may start at any index.
TEST(SweepCommand, TasksOfAJobArrayMergeToTheWhole) {
  const ScratchFolder folder;
  write_grid(folder);
  for (int task = 7; task <= 9; ++task) {
    const Outcome outcome = run_shell("SLURM_ARRAY_TASK_ID=" + std::to_string(task) +
                                          " SLURM_ARRAY_TASK_MIN=7 SLURM_ARRAY_TASK_COUNT=3 sh '" +
                                          kSourceFolder + "/stability/sweep/sweep.sbatch' grid.toml array",
                                      folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  }
  ASSERT_EQ(run_shell("swarmcert merge array", folder.path()).exit_code, 0);
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o whole", folder.path()).exit_code, 0);
  EXPECT_EQ(read_text(folder / "whole/sweep.json"), read_text(folder / "array/sweep.json"));
}

TEST(TuneCommand, FindsGainsThatAreBetterWithinTheConstraints) {
  const ScratchFolder folder;
  const Json result = json_of(folder, "tune" + kFlown + " --nodes 400");
  ASSERT_FALSE(result["gains"].is_null());
  const Json& tuned = result["tuned"];
  const Json& shipped = result["shipped"];
  EXPECT_LE(tuned["impulse"].get<double>(), shipped["impulse"].get<double>());
  EXPECT_LE(tuned["noise_command_m_s2"].get<double>(),
            shipped["noise_command_m_s2"].get<double>() * (1 + 1e-8));
  EXPECT_GE(tuned["lag_limit_s"].get<double>(), result["constraints"]["least_lag_limit_s"].get<double>());
  EXPECT_FALSE(result["active_constraints"].empty());
  EXPECT_EQ(result["verdict"], "found");
  // The rate gain must not get worse, which keeps the integrator: the gain is at least 1/(m Ki).
  EXPECT_LE(tuned["rate"].get<double>(), shipped["rate"].get<double>() * (1 + 1e-8));
  EXPECT_GE(result["gains"]["Ki"].get<double>(), 9.999);
  EXPECT_EQ(result["firmware_parameters"][0]["name"], "Kpos_P");
  EXPECT_EQ(result["firmware_parameters"][0]["shipped"], 10);
  EXPECT_EQ(result["firmware_parameters"][0]["tuned"], result["gains"]["Kp"]);
}

TEST(TuneCommand, SameSeedSameBytes) {
  const ScratchFolder folder;
  for (const char* out : {"a.json", "b.json"}) {
    ASSERT_EQ(
        run_shell("swarmcert tune" + kFlown + " --nodes 150 --seed 4 --json " + out, folder.path()).exit_code,
        0);
  }
  EXPECT_EQ(read_text(folder / "a.json"), read_text(folder / "b.json"));
}

TEST(TuneCommand, ConstraintsThatCannotBeMetAreRefutedOrNotFoundWithTheNearestGains) {
  const ScratchFolder folder;
  // The rate gain is at least 1/(0.034 kg 8 2 1/s^3) = 1.84 m per N/s if gains vary by at most a factor of 8.
  const Outcome refuted =
      run_shell("swarmcert tune" + kFlown + " --nodes 150 --max-rate 1.8 --json a.json", folder.path());
  EXPECT_EQ(refuted.exit_code, 1) << refuted.output;
  const Json a = files::parse_json(read_text(folder / "a.json"), "a.json");
  EXPECT_EQ(a["verdict"], "infeasible");
  EXPECT_TRUE(a["gains"].is_null());
  const Outcome none = run_shell(
      "swarmcert tune" + kFlown + " --nodes 150 --range 2 --max-noise 0.01 --json b.json", folder.path());
  EXPECT_EQ(none.exit_code, 4) << none.output;
  const Json b = files::parse_json(read_text(folder / "b.json"), "b.json");
  EXPECT_EQ(b["verdict"], "none found");
  EXPECT_FALSE(b["violated_constraints"].empty());
  EXPECT_GT(b["nearest"]["noise_command_m_s2"].get<double>(), 0.01);
}

TEST(TuneCommand, TunesWithoutAnIntegratorWhatHasNone) {
  const ScratchFolder folder;
  const std::string gains = gains_file(folder, "[position]\nKp = 9\nKd = 7\nKi = 0\nrate_hz = 500\n");
  const Json result = json_of(folder, "tune" + gains + " --axis x --objective amplitude --nodes 200");
  EXPECT_EQ(result["verdict"], "found");
  EXPECT_EQ(result["gains"]["Ki"], 0);
  EXPECT_LT(result["tuned"]["amplitude"].get<double>(), result["shipped"]["amplitude"].get<double>());
  EXPECT_LE(result["tuned"]["noise_command_m_s2"].get<double>(),
            result["shipped"]["noise_command_m_s2"].get<double>() * (1 + 1e-8));
  // Starting from gains with an integrator gives the same result.
  const Json dropped =
      json_of(folder, "tune" + kFlown + " --axis x --objective amplitude --no-integrator --nodes 200");
  EXPECT_EQ(dropped["gains"]["Ki"], 0);
  EXPECT_EQ(run_shell("swarmcert tune" + gains + " --axis x --objective rate", folder.path()).exit_code, 2);
  EXPECT_EQ(run_shell("swarmcert tune" + gains + " --axis x --max-rate 1", folder.path()).exit_code, 2);
}

TEST(TuneCommand, TheErrorThatItMinimisesIsTheOneThatBoundAnswersForTheTunedGains) {
  const ScratchFolder folder;
  write_text(folder / "disturbance.toml",
             "schema = \"swarmcert/disturbance/1\"\namplitude_N = 0.01\nbias_N = [0, 0, 0.01]\n");
  const std::string law = "rate_hz = 100\nintegrator_limit = 0.1\n[lag]\nmotor_s = 0.03\n",
                    under = " --disturbance disturbance.toml";
  const std::string gains = gains_file(folder, "[position]\nKp = 10\nKd = 5\nKi = 5\n" + law);
  const Json found = json_of(folder, "tune" + gains + " --axis z --objective error --nodes 100" + under);
  ASSERT_EQ(found["verdict"], "found");
  EXPECT_LT(found["tuned"]["error_m"].get<double>(), found["shipped"]["error_m"].get<double>());
  EXPECT_GE(found["tuned"]["thrust_margin_N"].get<double>(), 0);
  const auto of_z = [&](const char* gain, const char* others) {
    return std::string(gain) + " = [" + others + ", " + others + ", " + found["gains"][gain].dump() + "]\n";
  };
  write_text(folder / "tuned.toml", "schema = \"swarmcert/gains/1\"\n[position]\n" + of_z("Kp", "10") +
                                        of_z("Kd", "5") + of_z("Ki", "5") + law);
  const Json bound = json_of(folder, "bound --gains tuned.toml" + kModel + under);
  EXPECT_NEAR(bound["answer"]["error_m"]["z"].get<double>(), found["tuned"]["error_m"].get<double>(), 1e-4);
  EXPECT_NEAR(bound["thrust_margin_N"].get<double>(), found["tuned"]["thrust_margin_N"].get<double>(), 1e-9);
  EXPECT_EQ(run_shell("swarmcert tune" + gains + " --objective error", folder.path()).exit_code, 2);
}

TEST(TuneCommand, ProposesNothingCloseToALimitCycleOfTheAttitudeLoop) {
  const ScratchFolder folder;
  const std::string attitude = " --attitude-gains 0.007,0.001125,0.030";
  const std::string gains =
      gains_file(folder, "[position]\nKp = 9\nKd = 7\nKi = 0\nrate_hz = 500\n[lag]\nmotor_s = 0.0575\n");
  const std::string words =
      "tune" + gains + " --axis x --objective amplitude --nodes 200 --max-noise 30 --min-lag 0.05";
  const auto verdict_of = [&](const Json& found) {
    write_text(folder / "tuned.toml",
               "schema = \"swarmcert/gains/1\"\n[position]\nKi = 0\nrate_hz = 500\nKp = " +
                   found["gains"]["Kp"].dump() + "\nKd = " + found["gains"]["Kd"].dump() +
                   "\n[lag]\nmotor_s = 0.0575\n");
    return json_of(folder, "bound --gains tuned.toml" + kModel + attitude)["attitude"][0]["verdict"]
        .get<std::string>();
  };
  EXPECT_NE(verdict_of(json_of(folder, words)), "clear") << "else the constraint is not tested";
  const Json minding = json_of(folder, words + attitude);
  EXPECT_EQ(minding["verdict"], "found");
  EXPECT_EQ(verdict_of(minding), "clear");
  EXPECT_EQ(minding["tuned"]["limit_cycle"]["verdict"], "clear");
  EXPECT_EQ(run_shell("swarmcert tune" + gains + " --axis z" + attitude, folder.path()).exit_code, 2);
}

TEST(TuneCommand, MindsTheAttitudeLoopOfAnAxisBesideCoupledOnesAndRefusesThose) {
  const ScratchFolder folder;
  const std::string gains = gains_file(
      folder,
      "[position]\nLambda = [[1.2, 0, 0.3], [0, 1.8, 0], [0.3, 0, 2]]\nK = [0.12, 0.15, 0.2]\nrate_hz = 500\n"
      "[attitude]\nKR = 0.007\nKw = 0.00115\nKI = 0.02\n[lag]\nmotor_s = 0.0575\nbody_rate_s = 0.003\n");
  const Json result = json_of(folder, "tune" + gains + " --axis y --nodes 100");
  ASSERT_TRUE(result["shipped"].contains("limit_cycle"));
  EXPECT_NEAR(result["shipped"]["limit_cycle"]["gain_margin"].get<double>(),
              json_of(folder, "bound" + gains)["attitude"][0]["gain_margin"].get<double>(), 1e-9);
  const Outcome coupled = run_shell("swarmcert tune" + gains + " --axis x", folder.path());
  EXPECT_EQ(coupled.exit_code, 2);
  EXPECT_NE(coupled.output.find("couples axes"), std::string::npos) << coupled.output;
}

}  // namespace
}  // namespace swarmcert::tests

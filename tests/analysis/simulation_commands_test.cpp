// spacing compared with simulation, sweep when interrupted and on a cluster, iss-check and simulate as a user runs
// them.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "analysis/run.h"
#include "nn/base/json.h"
#include "stability/simulation/sampled_flight.h"

namespace swarmcert::tests {
namespace {

using files::Json;

const std::string kSource = SWARMCERT_SOURCE_DIR;

/// One vehicle high above the origin, and another that passes `gap_m` below it along x at a constant speed and
/// lateral distance, or stays there.
class Pass : public stability::Task {
 public:
  Pass(double gap_m, double side_m, double speed_m_s)
      : gap_m_(gap_m), side_m_(side_m), speed_m_s_(speed_m_s) {}
  stability::Setpoint at(int vehicle, double time_s) const override {
    stability::Setpoint to;
    to.p_W_m.z() = 3;
    if (vehicle == 1) return to;
    to.p_W_m = {speed_m_s_ > 0 ? speed_m_s_ * (time_s - duration_s() / 2) : 0, side_m_, 3 - gap_m_};
    to.v_W_m_s.x() = speed_m_s_;
    return to;
  }
  /// A pass begins and ends 1.5 m away and may take half a minute.
  double duration_s() const override { return speed_m_s_ > 0 ? std::min(3 / speed_m_s_ + 4, 40.0) : 25; }

 private:
  double gap_m_, side_m_, speed_m_s_;
};

/// Largest |z error| of the lower vehicle.
double flown_error_m(const stability::Model& model, const stability::Gains& gains, const Pass& pass) {
  stability::Swarm swarm(model, 2);
  swarm.assume_lag(gains.motor_lag_s, gains.delay_s);
  stability::SampledFlight flight(swarm, gains, pass, {});
  double largest = 0;
  while (flight.time_s() < pass.duration_s()) {
    flight.step();
    largest = std::max(largest, std::abs(flight.state()[2] - pass.at(0, flight.time_s()).p_W_m.z()));
  }
  return largest;
}

TEST(SpacingCommand, NothingThatItCallsSafeExceedsTheLimitInSimulation) {
  const ScratchFolder folder;
  const std::string model_path = kSource + "/stability/models/crazyflie-small-effects.toml";
  const stability::Model model = stability::read_model(model_path);
  struct Case {
    const char* gains;
    const char* limit;
  };
  const Case cases[] = {
      {"crazyflie-small", "0.1"},   {"crazyflie-small", "0.3"}, {"crazyflie-small-nominal", "0.05"},
      {"composite", "0.02"},        {"composite", "0.08"},      {"composite", "0.2"},
      {"firmware-defaults", "0.15"}};
  int safe = 0, stays = 0, crossings = 0;
  double nearest = 0;
  for (const Case& c : cases) {
    const std::string gains_path = kSource + "/controller/gains/" + c.gains + ".toml";
    const stability::Gains gains = stability::load_gains(gains_path);
    const Outcome run =
        run_shell("swarmcert spacing --gains '" + gains_path + "' --model '" + model_path +
                      "' --steps 4 --from 0.2 --max-error " + c.limit + " --force --json out.json",
                  folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.output;
    const double limit_m = std::stod(c.limit);
    const Json shape = files::parse_json(read_text(folder / "out.json"), "out.json")["shape"];
    for (const Json& row : shape) {
      const double gap_m = row["height_gap_m"];
      const auto check = [&](const Pass& pass, const std::string& what) {
        const double error_m = flown_error_m(model, gains, pass);
        EXPECT_LE(error_m, limit_m) << c.gains << ", gap " << gap_m << " m: " << what;
        nearest = std::max(nearest, error_m / limit_m);
        ++safe;
      };
      if (row["may_stay"]) {
        ++stays;
        check(Pass(gap_m, 0, 0), "stays below");
        check(Pass(gap_m, 0, 0.2), "passes slowly");
        continue;
      }
      if (!row["keep_out_radius_m"].is_null()) {
        check(Pass(gap_m, row["keep_out_radius_m"], 0), "stays at the keep-out radius");
      }
      if (!row["may_cross"]) continue;
      ++crossings;
      const double least_m_s = std::max(row["least_speed_m_s"].get<double>(), 0.1);
      for (const double factor : {1.0, 1.7}) {
        check(Pass(gap_m, 0, factor * least_m_s),
              "crosses at " + std::to_string(factor * least_m_s) + " m/s");
      }
      check(Pass(gap_m, 0.05, least_m_s), "crosses off the centre");
    }
  }
  EXPECT_GT(safe, 40);
  EXPECT_GT(stays, 2);
  EXPECT_GT(crossings, 8);
  // One pass attains less than the sequences of passes for which the limits hold.
  EXPECT_GT(nearest, 0.4) << "the limits must be of the size of the errors for the test to say something";
}

void write_sweep(const ScratchFolder& folder, int steps) {
  write_text(folder / "gains.toml",
             "schema = \"swarmcert/gains/1\"\n[position]\nKp = 10\nKd = 5\nKi = 10\nintegrator_limit = 0.1\n"
             "rate_hz = 500\n[lag]\nmotor_s = 0.0575\n");
  write_text(folder / "grid.toml",
             "schema = \"swarmcert/grid/1\"\ngains = \"gains.toml\"\nmodel = \"" + kSource +
                 "/stability/models/crazyflie-small.toml\"\naxis = \"z\"\n"
                 "compute = [\"amplitude\", \"impulse\", \"noise_command_m_s2\", \"thrust_margin_N\"]\n"
                 "pareto = [\"impulse\", \"noise_command_m_s2\"]\n[disturbance]\namplitude_N = 0.02\n"
                 "[axes]\nKp = {from = 2, to = 40, steps = " +
                 std::to_string(steps) +
                 ", scale = \"log\"}\nmass_kg = {from = 0.03, to = 0.09, steps = 4}\n"
                 "battery_V = {from = 3.2, to = 4.2, steps = 3}\nvehicles = {from = 1, to = 8, steps = 8}\n");
}

TEST(SweepCommand, CtrlCKeepsWhatIsDoneAndResumeGivesTheSameBytes) {
  const ScratchFolder folder;
  write_sweep(folder, 30);
  // Interrupts the run as soon as it has computed something. On a fast machine it may have ended by then, so there
  // are several tries.
  int cells = 0, total = 0;
  for (const char* wait_s : {"0.4", "0.2", "0.1", "1.5"}) {
    run_shell("rm -rf cut", folder.path());
    const Outcome outcome = run_shell(std::string("timeout --preserve-status -s INT ") + wait_s +
                                          " swarmcert sweep grid.toml -o cut -q -j 1",
                                      folder.path());
    const std::string shard = folder / "cut/shard-0-of-1.json";
    if (outcome.exit_code != 4 || !std::filesystem::exists(shard)) continue;
    EXPECT_NE(outcome.output.find("--resume continues"), std::string::npos) << outcome.output;
    const Json kept = files::parse_json(read_text(shard), "shard");
    cells = static_cast<int>(kept["cells"].size());
    total = kept["total"];
    if (cells > 0 && cells < total) break;
  }
  ASSERT_GT(cells, 0);
  ASSERT_LT(cells, total);
  ASSERT_EQ(run_shell("swarmcert merge cut", folder.path()).exit_code, 3) << "an incomplete sweep is refused";
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o cut -q --resume", folder.path()).exit_code, 0);
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o whole -q", folder.path()).exit_code, 0);
  EXPECT_EQ(read_text(folder / "cut/sweep.json"), read_text(folder / "whole/sweep.json"));
  EXPECT_EQ(read_text(folder / "cut/report/report.html"), read_text(folder / "whole/report/report.html"));
}

TEST(SweepCommand, CellsWhereTheThrustDoesNotSufficeAreInfeasibleWithTheReason) {
  const ScratchFolder folder;
  write_sweep(folder, 5);
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o out -q", folder.path()).exit_code, 0);
  int cannot_hover = 0, too_weak = 0, feasible = 0;
  const Json points = files::parse_json(read_text(folder / "out/sweep.json"), "sweep.json")["points"];
  for (const Json& point : points) {
    const std::string reason = point["reason"];
    const Json& margin = point["values"]["thrust_margin_N"];
    if (reason.empty()) {
      ++feasible;
      EXPECT_GE(margin.get<double>(), 0);
    } else if (reason.find("cannot lift") != std::string::npos) {
      ++cannot_hover;
      EXPECT_GT(point["at"]["mass_kg"].get<double>(), 0.04);
    } else if (reason.find("thrust") != std::string::npos) {
      ++too_weak;
    }
  }
  EXPECT_GT(cannot_hover, 0);
  EXPECT_GT(too_weak, 0);
  EXPECT_GT(feasible, 0);
}

TEST(SweepCommand, InfeasibleCellsAreCountedByReasonWithoutTheValuesOfEachCell) {
  const ScratchFolder folder;
  write_sweep(folder, 5);
  write_text(folder / "grid.toml",
             read_text(folder / "grid.toml") + "[limits.noise_command_m_s2]\nmost = 0.14\n");
  const Outcome sweep = run_shell("swarmcert sweep grid.toml -o out", folder.path());
  ASSERT_EQ(sweep.exit_code, 0) << sweep.output;
  std::map<std::string, int> lines;
  const Json points = files::parse_json(read_text(folder / "out/sweep.json"), "sweep.json")["points"];
  for (const Json& point : points) ++lines[std::string(point["reason"]).substr(0, 20)];
  lines.erase("");
  ASSERT_EQ(lines.count("noise_command_m_s2 i"), 1);
  for (const auto& [reason, count] : lines)
    EXPECT_NE(sweep.output.find(fmt::format("  {:>7} infeasible: {}", count, reason)), std::string::npos)
        << sweep.output;
  for (const char* whole : {": noise_command_m_s2 is above 0.14\n", ": the rotors cannot lift the vehicle\n",
                            ": the thrust is not proved to suffice under the disturbance\n"})
    EXPECT_NE(sweep.output.find(whole), std::string::npos) << sweep.output;
}

TEST(SweepCommand, AJobArrayOnARealSlurmMergesToTheBytesOfAnUndividedRun) {
  const ScratchFolder folder;
  write_sweep(folder, 4);
  const Outcome array =
      run_shell("'" + kSource + "/tests/analysis/private_slurm.sh' sbatch --wait --array=3-6 '" + kSource +
                    "/stability/sweep/sweep.sbatch' grid.toml array",
                folder.path());
  if (array.exit_code == 77) GTEST_SKIP() << array.output;
  ASSERT_EQ(array.exit_code, 0) << array.output;
  for (int task = 0; task < 4; ++task) {
    EXPECT_TRUE(std::filesystem::exists(folder / ("array/shard-" + std::to_string(task) + "-of-4.json")))
        << task;
  }
  const Outcome merged = run_shell("swarmcert merge array", folder.path());
  ASSERT_EQ(merged.exit_code, 0) << merged.output;
  ASSERT_EQ(run_shell("swarmcert sweep grid.toml -o whole -q", folder.path()).exit_code, 0);
  EXPECT_EQ(read_text(folder / "whole/sweep.json"), read_text(folder / "array/sweep.json"));
}

TEST(SimulateCommand, LogsAreTheSameBytesForEveryWidthOfRegisters) {
  const ScratchFolder folder;
  for (const std::string task : {"circle --vehicles 5", "swap --vehicles 3"}) {
    const std::string simulate = "swarmcert simulate " + task + " --duration 3 --seed 3 -q --force --model " +
                                 kSource + "/stability/models/crazyflie-small-effects.toml --gains " +
                                 kSource + "/controller/gains/crazyflie-small.toml -o $k";
    const Outcome result = run_shell("for k in narrow avx2 avx512; do SWARMCERT_KERNELS=$k " + simulate +
                                         " || exit 9; done; diff -r narrow avx2 && diff -r narrow avx512",
                                     folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.output;
  }
}

}  // namespace
}  // namespace swarmcert::tests

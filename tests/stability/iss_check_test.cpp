#include "stability/iss/iss_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "data.h"
#include "stability/iss/iss_full_loop.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

Gains composite(const std::string& lambda, const std::string& k, const std::string& more = "") {
  return parse_gains(
      "schema = \"swarmcert/gains/1\"\n[position]\nLambda = " + lambda + "\nK = " + k + "\n" + more,
      "gains.toml");
}

IssOptions with_runs(int runs) {
  IssOptions options;
  options.runs = runs;
  return options;
}

double worst_of(const IssCheck& check, const std::string& kind) {
  double worst = 0;
  for (const IssRun& run : check.runs) {
    if (run.kind == kind) worst = std::max(worst, run.ratio);
  }
  return worst;
}

TEST(IssCheck, IsotropicGainsReachTheBallByARampAndNothingExceedsIt) {
  for (const auto& [lambda, k] : {std::pair{"4", "0.136"}, std::pair{"2", "0.2"}, std::pair{"1", "0.5"}}) {
    const IssCheck check = check_iss(flown_loop(composite(lambda, k), tests::small_vehicle()), {});
    EXPECT_TRUE(check.theorem_applies);
    EXPECT_EQ(check.violations, 0);
    EXPECT_GT(worst_of(check, "ramp"), 0.999);
    EXPECT_LE(check.worst_ratio, 1 + 1e-9);
    EXPECT_LE(check.worst_transient_ratio, 1 + 1e-6);
    EXPECT_GT(check.worst_transient_ratio, 0.9) << "the starts must come near the transient";
  }
}

TEST(IssCheck, HasTheBallOfTheTables) {
  // 1 / (k l^2) for l = 4, k = 0.136 and l = 2, k = 0.2: 0.45955882352941174 and 1.25 m per N/s.
  const IssCheck a1 = check_iss(flown_loop(composite("4", "0.136"), tests::small_vehicle()), with_runs(5));
  EXPECT_NEAR(a1.ball_m / a1.rate_N_s, 0.45955882352941174, 1e-12);
  const IssCheck a2 = check_iss(flown_loop(composite("2", "0.2"), tests::small_vehicle()), with_runs(5));
  EXPECT_NEAR(a2.ball_m / a2.rate_N_s, 1.25, 1e-12);
}

TEST(IssCheck, AnisotropicGainsStayInsideWhereTheTheoremIsConservative) {
  // As in vector_gain_test.cpp: theorem 5.0, exact 2-norm peak gain 1.2503991779, ratio 0.25008.
  const IssCheck check =
      check_iss(flown_loop(composite("[2, 2, 4]", "[0.2, 0.2, 0.05]"), tests::small_vehicle()), {});
  EXPECT_EQ(check.violations, 0);
  EXPECT_LE(check.worst_ratio, 0.25008 + 1e-4);
  EXPECT_GT(check.worst_ratio, 0.95 * 0.25008);
}

TEST(IssCheck, NoneOfTenThousandOfEachKindLeavesBallOrTransient_slow) {
  const IssCheck check =
      check_iss(flown_loop(composite("4", "0.136"), tests::small_vehicle()), with_runs(63000));
  std::map<std::string, int> count;
  for (const IssRun& run : check.runs) ++count[run.kind];
  for (const char* const kind : {"ramp", "worst_linear", "bang_bang", "random", "initial_state"}) {
    EXPECT_GE(count[kind], 10000) << kind;  // a fifth of the runs are evaluations of the optimisers
  }
  EXPECT_EQ(check.violations, 0);
  EXPECT_GT(check.worst_ratio, 0.999);
}

TEST(IssCheck, FindsTheViolationsOfBrokenHypotheses) {
  const struct {
    const char* what;
    Gains gains;
  } broken[] = {
      // By DOP853: at tau = 0.0625 the command channel's rate norm is 0.4596536, above the ball of 0.4595588.
      {"motor lag", composite("4", "0.136", "[lag]\nmotor_s = 0.0625\n")},
      {"Lambda not symmetric", composite("[[2, 12, 0], [0, 2, 0], [0, 0, 2]]", "0.2")},
      {"complex poles",
       parse_gains("schema = \"swarmcert/gains/1\"\n[position]\nKp = 5\nKd = 8\nKi = 25\n", "g.toml")},
  };
  for (const auto& [what, gains] : broken) {
    SCOPED_TRACE(what);
    const IssCheck check = check_iss(flown_loop(gains, tests::small_vehicle()), with_runs(45));
    EXPECT_FALSE(check.theorem_applies);
    EXPECT_FALSE(check.why_not.empty());
    EXPECT_GT(check.violations, 0);
    EXPECT_GT(check.worst_ratio, 1 + 1e-6);
    EXPECT_FALSE(check.is_refuted()) << "the theorem claims nothing about such gains";
    EXPECT_FALSE(check.why_inconclusive().empty());
  }
}

TEST(IssCheck, RunsThatLeaveAHypothesisAreLabelledAndRefuteNothing) {
  const FlownLoop plain = flown_loop(composite("4", "0.136"), tests::small_vehicle());
  // Rotors that always give some force saturate before the commanded force is near zero.
  FlownLoop stoppable = plain;
  stoppable.plant.least_thrust_N = 0;
  const struct {
    const char* expected;
    FlownLoop loop;
    double rate_N_s;
  } cases[] = {{"the integral reaches its clamp",
                flown_loop(composite("4", "0.136", "integrator_limit = 0.01\n"), tests::small_vehicle()), 0},
               {"the commanded force is near zero", stoppable, 0.3},
               {"the commanded force tilts by 90 degrees", plain, 0.3},
               {"the thrust saturates", plain, 0.3},
               {"the thrust saturates", plain, 1e308}};
  for (const auto& [expected, loop, rate_N_s] : cases) {
    SCOPED_TRACE(std::string(expected) + ", " + std::to_string(rate_N_s));
    IssOptions options = with_runs(60);
    options.rate_N_s = rate_N_s;
    const IssCheck check = check_iss(loop, options);
    int labelled = 0;
    for (const IssRun& run : check.runs) {
      labelled += run.left == expected;
      if (run.left.empty()) continue;
      EXPECT_GE(run.left_at_s, 0);
      EXPECT_LT(run.left_at_s, check.duration_s);
      EXPECT_LE(run.at_s, run.left_at_s) << "nothing counts after the hypothesis is left";
    }
    EXPECT_GT(labelled, 0);
    EXPECT_EQ(check.violations, 0);
    EXPECT_FALSE(check.is_refuted());
    ASSERT_FALSE(check.why_inconclusive().empty());
    std::string reasons;
    for (const std::string& why : check.why_inconclusive()) reasons += why + "\n";
    EXPECT_NE(reasons.find(expected), std::string::npos) << reasons;
    EXPECT_EQ(reasons.find("failed"), std::string::npos) << reasons;
  }
}

TEST(IssCheck, AViolationWithEveryHypothesisKeptRefutes) {
  // No loop of the theorem exceeds its ball, so the verdict is tested on a campaign with an artificial violation.
  IssCheck check;
  check.theorem_applies = true;
  check.violations = 1;
  EXPECT_TRUE(check.is_refuted());
  EXPECT_TRUE(check.why_inconclusive().empty());
  check.theorem_applies = false;
  EXPECT_FALSE(check.is_refuted());
  check = {};
  check.theorem_applies = true;
  EXPECT_TRUE(check.why_inconclusive().empty());
  check.failed = 1;
  EXPECT_FALSE(check.why_inconclusive().empty()) << "a run that could not be integrated shows nothing";
}

/// All shipped gains on both vehicles: there is always a verdict, and gains that satisfy the theorem are not refuted.
void check_shipped_gains(const std::vector<double>& rates_N_s, const std::vector<std::string>& models,
                         int runs) {
  const std::filesystem::path source = SWARMCERT_SOURCE_DIR;
  int campaigns = 0, left = 0, complete = 0;
  for (const auto& file : std::filesystem::directory_iterator(source / "controller/gains")) {
    if (file.path().extension() != ".toml") continue;
    const Gains gains = load_gains(file.path().string());
    for (const std::string& name : models) {
      const Model model = read_model((source / "stability/models" / name).string());
      for (const double rate_N_s : rates_N_s) {
        SCOPED_TRACE(file.path().filename().string() + ", " + name + ", " + std::to_string(rate_N_s));
        IssOptions options = with_runs(runs);
        options.rate_N_s = rate_N_s;
        const IssCheck check = check_iss(flown_loop(gains, model), options);
        const std::vector<FullLoopRun> flown = fly_full_loop(gains, model, check);
        ++campaigns;
        left += check.left > 0;
        complete += check.left == 0 && check.failed == 0;
        EXPECT_FALSE(check.is_refuted());
        EXPECT_EQ(check.violations > 0 || check.failed > 0 || check.left > 0 || !check.theorem_applies,
                  check.violations > 0 || !check.why_inconclusive().empty());
        EXPECT_TRUE(std::isfinite(check.worst_ratio) && std::isfinite(check.worst_transient_ratio));
        for (const FullLoopRun& run : flown) EXPECT_TRUE(std::isfinite(run.ratio)) << run.failure;
      }
    }
  }
  EXPECT_GE(campaigns, 5 * static_cast<int>(rates_N_s.size()));
  EXPECT_GT(left, 0);
  EXPECT_GT(complete, 0);
}

TEST(IssCheck, ShippedGainsGetAnAnswerAtEveryRate) {
  check_shipped_gains({0.01, 0.1, 0.25, 0.38, 3, 1e308}, {"crazyflie-small.toml"}, 10);
}

TEST(IssCheck, ShippedGainsGetAnAnswerOnAGridOfRates_slow) {
  std::vector<double> rates_N_s = {1e-300, 1e-3, 10, 1e6, 1e308};
  for (double rate_N_s = 0.01; rate_N_s < 3.1; rate_N_s *= 1.1) rates_N_s.push_back(rate_N_s);
  check_shipped_gains(rates_N_s, {"crazyflie-small.toml", "crazyflie-large.toml"}, 20);
}

TEST(IssCheck, EveryViolationShowsInARatioAboveOne) {
  // With unequal gains the errors stay far below the ball; the lag violates the transient bound at its start.
  const IssCheck check =
      check_iss(flown_loop(composite("[3.1, 2.5, 4.2]", "[0.12, 0.2, 0.09]", "[lag]\nmotor_s = 0.03\n"),
                           tests::small_vehicle()),
                with_runs(45));
  EXPECT_LT(check.worst_ratio, 1);
  EXPECT_GT(check.violations, 0);
  for (const IssRun& run : check.runs) {
    EXPECT_EQ(run.is_violation, std::max(run.ratio, run.transient_ratio) > 1 + 1e-6) << run.kind;
  }
}

TEST(IssCheck, DoesNotDependOnJobsOrOnTheRate) {
  IssOptions options;
  options.runs = 60;
  options.jobs = 1;
  const IssCheck one = check_iss(flown_loop(composite("2", "0.2"), tests::small_vehicle()), options);
  options.jobs = 3;
  const IssCheck three = check_iss(flown_loop(composite("2", "0.2"), tests::small_vehicle()), options);
  ASSERT_EQ(one.runs.size(), three.runs.size());
  for (std::size_t i = 0; i < one.runs.size(); ++i) EXPECT_EQ(one.runs[i].largest_m, three.runs[i].largest_m);
  options.rate_N_s = one.rate_N_s / 7;
  const IssCheck slower = check_iss(flown_loop(composite("2", "0.2"), tests::small_vehicle()), options);
  EXPECT_NEAR(slower.worst_ratio, one.worst_ratio, 1e-6) << "the unsaturated loop is linear";
}

TEST(IssCheck, VerticalRampsReachTheBallInTheFullLoopToo) {
  const Gains gains = composite("4", "0.136", "[attitude]\nlaw = \"lee\"\n");
  const IssCheck check = check_iss(flown_loop(gains, tests::small_vehicle()), with_runs(30));
  const std::vector<FullLoopRun> flown = fly_full_loop(gains, tests::small_vehicle(), check);
  ASSERT_EQ(flown.size(), 6u);
  double vertical = 0, tilt = 0;
  for (const FullLoopRun& run : flown) {
    const IssRun& of = check.runs[static_cast<std::size_t>(run.run)];
    tilt = std::max(tilt, run.largest_tilt_rad);
    if (of.kind != "ramp" || of.disturbance.rate_W_N_s[0].z() == 0) continue;
    vertical = run.ratio;
  }
  EXPECT_GT(vertical, 0.999);
  EXPECT_LT(vertical, 1 + 1e-6);
  EXPECT_GT(tilt, 0.05) << "horizontal disturbances must tilt the vehicle";
}

}  // namespace
}  // namespace swarmcert::stability

/// Hidden forces that resemble effects of the registry but have another form: diagnose does not give them the name of
/// the effect they resemble, or says what else they may be. The effects themselves keep their names.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "analysis/run.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

using Eigen::Vector3d;

using HiddenForce = std::function<Vector3d(const Moment&)>;

const std::string& model_path() {
  static const std::string path = source_path("stability/models/crazyflie-small.toml");
  return path;
}

/// Flies four times with a hidden force.
void fly_with(const HiddenForce& force_N, int vehicles, std::uint64_t seed, const std::string& folder) {
  Truth truth;
  truth.force_N = force_N;
  for (int run = 0; run < 4; ++run)
    fly(truth, {Program::kRich, vehicles, 40, seed + static_cast<std::uint64_t>(run)}, folder, run);
}

/// Returns the answer of diagnose on such flights.
files::Json answer_to(const HiddenForce& force_N, std::uint64_t seed, int vehicles = 1) {
  const ScratchFolder folder;
  fly_with(force_N, vehicles, seed, folder / "flights");
  const Outcome outcome =
      run_shell("swarmcert diagnose '" + model_path() + "' flights -q --json result.json", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  return files::read_json(folder / "result.json", "swarmcert/diagnose/1");
}

std::vector<std::string> names_in(const files::Json& answer) {
  std::vector<std::string> names;
  for (const files::Json& named : answer["ranking"]) names.push_back(named["effect"]);
  return names;
}

Vector3d cubic_drag(const Moment& now) { return -0.06 * now.v_m_s.squaredNorm() * now.v_m_s; }

TEST(DragOfAnotherExponent, IsAFormulaOfTheSpeedAndNotNamedQuadratic) {
  const files::Json answer = answer_to(cubic_drag, 900);
  EXPECT_EQ(names_in(answer), std::vector<std::string>());
  EXPECT_EQ(answer["verdict"], "unexplained");
  const files::Json& first = answer["remainder"].at(0);
  EXPECT_EQ(first["variable"], "speed");
  EXPECT_EQ(first["frame"], "velocity");
  EXPECT_EQ(first["form"], "power");
}

TEST(DragOfAnotherExponent, IsAddedAsAFormulaThatLeavesLessThanQuadraticDrag) {
  const ScratchFolder folder;
  fly_with(cubic_drag, 1, 950, folder / "flights");
  const auto left_N = [&](const std::string& effect) {
    const Outcome outcome = run_shell("swarmcert add " + effect + " --model '" + model_path() +
                                          "' flights -o fitted.toml -q --force --json result.json",
                                      folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    const files::Json result = files::read_json(folder / "result.json", "swarmcert/add/1");
    return result["ladder"].back()["select_rmse"].get<double>();
  };
  EXPECT_LT(left_N("formula"), 0.9 * left_N("drag_quadratic"));
}

TEST(DragOfTheNamedExponents, StaysNamed) {
  const auto quadratic = [](const Moment& now) { return Vector3d(-0.05 * now.v_m_s.norm() * now.v_m_s); };
  EXPECT_EQ(names_in(answer_to(quadratic, 910)), std::vector<std::string>{"drag_quadratic"});
  const auto linear = [](const Moment& now) { return Vector3d(-0.03 * now.v_m_s); };
  EXPECT_EQ(names_in(answer_to(linear, 920)), std::vector<std::string>{"drag_linear"});
}

TEST(DragThatDiffersBetweenBodyAxes, IsNotNamedAsADragOfAllAxes) {
  const auto drag = [](const Moment& now) {
    return Vector3d(-0.06 * now.b1.dot(now.v_m_s) * now.b1 - 0.03 * now.b2.dot(now.v_m_s) * now.b2);
  };
  const files::Json answer = answer_to(drag, 936);
  EXPECT_EQ(names_in(answer), std::vector<std::string>());
  EXPECT_EQ(answer["verdict"], "unexplained");
  EXPECT_EQ(answer["remainder"].at(0)["variable"], "vx");
}

TEST(ThrustThatFadesWithTime, IsNotNamedABatteryThatSags) {
  const auto fade = [](const Moment& now) { return Vector3d(-0.002 * now.time_s * now.thrust_N * now.b3); };
  const files::Json answer = answer_to(fade, 940);
  EXPECT_EQ(names_in(answer), std::vector<std::string>());
  EXPECT_EQ(answer["verdict"], "unexplained");
  const std::string variable = answer["remainder"].at(0)["variable"];
  EXPECT_TRUE(variable == "time" || variable == "battery") << variable;
}

/// A wake of another form than those of the registry, twice as wide as its default, which arrives at once.
Vector3d wide_wake(const Moment& now) {
  double force_N = 0;
  for (const Moment::Other& other : now.others) {
    const double below_m = other.dp_m.z();
    if (below_m < 0.05) continue;
    const double width_m = 0.07 + 0.1 * below_m, beside_m = other.dp_m.head<2>().norm();
    force_N -= 0.085 * (0.07 / width_m) * std::exp(-beside_m * beside_m / (2 * width_m * width_m));
  }
  return {0, 0, force_N};
}

TEST(WideWake, ThatArrivesAtOnceIsADownwashAndNotDelayed) {
  EXPECT_EQ(names_in(answer_to(wide_wake, 700, 3)), std::vector<std::string>{"downwash"});
}

}  // namespace
}  // namespace swarmcert::tests

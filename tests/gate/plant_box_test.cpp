// Tracking bounds over an uncertain vehicle: the enclosure is never below a bound reached by a plant of the box.
#include "analysis/gate/plant_box.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "analysis/gate/gate.h"
#include "analysis/run.h"
#include "nn/temp_folder.h"
#include "stability/vehicle.h"

namespace swarmcert::gate {
namespace {

using stability::DisturbanceSource;
using stability::FlownLoop;
using stability::UncertainPlant;

/// A continuous loop with known gains.
/// @param limit_m_s limit of the integrator.
FlownLoop continuous_setup(double limit_m_s) {
  FlownLoop setup;
  setup.model = tests::small_vehicle();
  setup.plant.mass_kg = setup.model.mass_kg;
  setup.gains = stability::load_gains(tests::source_path("controller/gains/crazyflie-small.toml"));
  setup.gains.rate_hz = setup.gains.integrator_step_s = 0;
  setup.gains.network_rate_hz = setup.gains.network_latency_s = 0;
  setup.gains.motor_lag_s = setup.gains.delay_s = 0;
  setup.gains.integrator_limit_m_s = {limit_m_s, limit_m_s, limit_m_s};
  return setup;
}

UncertainPlant box_about(const FlownLoop& setup) {
  const double m = setup.plant.mass_kg;
  return {{0.95 * m, 1.05 * m}, {0.9, 1.2}, {0.03, 0.03}, {0, 0}};
}

DisturbanceSource force_and_estimates(double amplitude_N, double velocity_m_s, double position_m) {
  DisturbanceSource source;
  source.kind = "declared";
  for (int axis = 0; axis < 3; ++axis) {
    source.axis[axis].amplitude_N = amplitude_N;
    source.velocity_error[axis].amplitude = velocity_m_s;
    source.position_error[axis].amplitude = position_m;
  }
  return source;
}

TEST(PlantBox, NoCornerIsAboveTheEnclosure) {
  for (const double limit_m_s : {std::numeric_limits<double>::infinity(), 2.0, 0.02}) {
    const FlownLoop setup = continuous_setup(limit_m_s);
    for (const auto& [amplitude_N, velocity_m_s, position_m] :
         {std::array<double, 3>{0.02, 0, 0}, {0.02, 0.1, 0}, {0.02, 0, 0.01}, {0, 0.1, 0.02}}) {
      const BoxBound bound =
          bound_over(setup, box_about(setup), force_and_estimates(amplitude_N, velocity_m_s, position_m));
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_TRUE(std::isfinite(bound.reached_m[axis])) << axis;
        EXPECT_GT(bound.reached_m[axis], 0);
        if (bound.is_enclosed) {
          EXPECT_GE(bound.enclosed_m[axis], bound.reached_m[axis] * (1 - 1e-9))
              << "limit " << limit_m_s << ", axis " << axis;
        }
      }
      EXPECT_TRUE(bound.is_enclosed);
    }
  }
}

TEST(PlantBox, NoBoundHoldsOfALoopThatDivergesAroundTheAttitudeLoopThatItsGainsState) {
  FlownLoop setup = continuous_setup(0.5);
  setup.plant.largest_thrust_N = 1;
  const auto thrust = [&] {
    return bound_over(setup, box_about(setup), force_and_estimates(1e-3, 0, 0)).saturation;
  };
  EXPECT_TRUE(thrust().is_proved());
  setup.gains.attitude = stability::AttitudeGains{{2e-3, 2e-3, 2e-3}, {2e-5, 2e-5, 2e-5}, {0, 0, 0}};
  EXPECT_FALSE(thrust().is_proved());
  EXPECT_NE(thrust().why.find("[attitude] diverges"), std::string::npos);
}

TEST(PlantBox, TheIntegralOfAnActingClampPassesTheLargestThrustScale) {
  // Thrust of 1.3 times the command: the integral's part of the command acts 1.3 times as well.
  const FlownLoop setup = continuous_setup(0.5);
  UncertainPlant box = box_about(setup);
  box.lag_s = box.delay_s = {0, 0};
  box.mass_kg = {setup.plant.mass_kg, setup.plant.mass_kg};
  box.thrust_scale = {1.3, 1.5};
  FlownLoop strong = setup;
  strong.plant.thrust_scale = 1.3;
  const DisturbanceSource source = force_and_estimates(0.25, 0, 0);
  const BoxBound bound = bound_over(setup, box, source);
  const stability::TrackingReport corner = stability::tracking_bounds(strong, source, {});
  int acting = 0;
  for (const stability::AxisBounds& row : corner.bounds) {
    if (row.loop != stability::Loop::kContinuous) continue;
    acting += !row.clamp.never_acts;
    EXPECT_GE(bound.enclosed_m[row.axis], row.least() * (1 - 1e-9)) << row.axis;
  }
  EXPECT_GT(acting, 0);
}

TEST(PlantBox, ErrorsOfTheEstimatesWidenTheBound) {
  const FlownLoop setup = continuous_setup(std::numeric_limits<double>::infinity());
  const BoxBound without = bound_over(setup, box_about(setup), force_and_estimates(0.02, 0, 0));
  const BoxBound velocity = bound_over(setup, box_about(setup), force_and_estimates(0.02, 0.1, 0));
  const BoxBound position = bound_over(setup, box_about(setup), force_and_estimates(0.02, 0, 0.01));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(velocity.reached_m[axis], 1.1 * without.reached_m[axis]);
    EXPECT_GT(velocity.enclosed_m[axis], 1.1 * without.enclosed_m[axis]);
    // The vehicle follows the erroneous position.
    EXPECT_GT(position.reached_m[axis], without.reached_m[axis] + 0.01);
  }
}

TEST(PlantBox, TheThrustMarginIsNegativeExactlyIfTheForceErrorSaturatesTheThrust) {
  FlownLoop setup = continuous_setup(2.0);
  EXPECT_FALSE(bound_over(setup, box_about(setup), force_and_estimates(0.02, 0, 0)).saturation.is_proved());
  setup.plant.largest_thrust_N = 0.84;  // of which the weight takes 0.33
  const auto found = [&](double amplitude_N) {
    return bound_over(setup, box_about(setup), force_and_estimates(amplitude_N, 0, 0)).saturation;
  };
  EXPECT_TRUE(found(0.005).is_proved()) << found(0.005).why;
  EXPECT_GT(found(0.005).margin_N(), 0);
  EXPECT_LT(found(0.5).margin_N(), 0);
  EXPECT_EQ(found(0.5).verdict, stability::Saturation::Verdict::kRefuted) << found(0.5).why;
}

TEST(PlantBox, TheGateDoesNotPassATrackingLimitWhoseForceErrorSaturatesTheThrust) {
  const tests::TempFolder folder;
  tests::write_text(folder / "gains.toml",
                    tests::read_text(tests::source_path("controller/gains/crazyflie-small.toml")));
  tests::write_text(folder / "model.toml",
                    tests::read_text(tests::source_path("stability/models/crazyflie-small.toml")));
  const auto judged = [&folder](const std::string& amplitude_N) {
    tests::write_text(folder / "policy.toml",
                      "schema = \"swarmcert/policy/1\"\n[release]\ngains = \"gains.toml\"\nmodel = "
                      "\"model.toml\"\n[tracking]\nguard_factor = 1\nover = \"corners\"\nmax_error_m = 1000\n"
                      "amplitude_N = " +
                          amplitude_N + "\n");
    return run_gate(read_policy(folder / "policy.toml"), {}).checks.at(0);
  };
  EXPECT_EQ(judged("0.005").verdict, Verdict::kPass) << judged("0.005").reason;
  EXPECT_EQ(judged("5").verdict, Verdict::kInconclusive);
  EXPECT_NE(judged("5").reason.find("only if the thrust does not saturate, which is refuted"),
            std::string::npos)
      << judged("5").reason;
}

}  // namespace
}  // namespace swarmcert::gate

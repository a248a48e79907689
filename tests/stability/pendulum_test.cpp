#include "stability/effects/pendulum.h"

#include <gtest/gtest.h>

#include <cmath>

#include "stability/bounds/truth_bounds.h"
#include "stability/simulation/continuous_flight.h"
#include "stability/simulation/sampled_flight.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

constexpr double kLoad_kg = 0.006, kString_m = 0.4;

Model with_load(double load_kg, double length_m, double damping_1_s) {
  Model model = tests::small_vehicle();
  EffectSpec spec;
  spec.name = "pendulum";
  spec.parameters = {{"mass_kg", load_kg}, {"length_m", length_m}, {"damping_1_s", damping_1_s}};
  model.effects.push_back(spec);
  return model;
}

/// A level vehicle whose rotors carry its own weight and that of the load.
struct CarriedLoad {
  CarriedLoad(double length_m, double damping_1_s)
      : swarm(with_load(kLoad_kg, length_m, damping_1_s), 1),
        rows(swarm.make_rows()),
        state(kVehicleStateSize + 6) {
    set_hover(swarm.model(0), {0, 0, 1}, {0, 0, 0}, state.data());
    for (double& force_N : input.rotor_command_N)
      force_N = (tests::kMass_kg + kLoad_kg) * kGravity_m_s2 / kNumRotors;
  }

  void move(double time_s) {
    constexpr double kStep_s = 1e-3;
    swarm.to_rows(state.data(), rows.data());
    swarm.runge_kutta(0, kStep_s, static_cast<int>(std::lround(time_s / kStep_s)), &input, rows.data());
    swarm.from_rows(rows.data(), state.data());
  }

  double& swing_m() { return state[kVehicleStateSize]; }
  double& swing_m_s() { return state[kVehicleStateSize + 3]; }

  Swarm swarm;
  Rows rows;
  std::vector<double> state;
  VehicleInput input;
};

TEST(Pendulum, HasSixStatesBehindThoseOfTheVehicles) {
  Swarm with(with_load(kLoad_kg, kString_m, 0.1), 3), without(tests::small_vehicle(), 3);
  EXPECT_EQ(with.state_size(), 3 * (kVehicleStateSize + 6));
  EXPECT_EQ(without.state_size(), 3 * kVehicleStateSize);
}

TEST(Pendulum, SwingsFreelyAtTheFrequencyOfBothMasses) {
  // A load of mass m_l below a free vehicle of mass m: omega^2 = (g / l) (1 + m_l / m), without damping; half a period
  // reverses the swing, and the common centre of mass does not move.
  constexpr double kSmall_m = 1e-3;
  for (const double length_m : {0.15, 0.4, 1.5}) {
    CarriedLoad carried(length_m, 0.01);
    carried.swing_m() = kSmall_m;
    const double omega = std::sqrt(kGravity_m_s2 / length_m * (1 + kLoad_kg / tests::kMass_kg));
    const double half_s = M_PI / omega;
    carried.move(half_s);
    EXPECT_NEAR(carried.swing_m(), -kSmall_m * std::exp(-0.005 * (1 + kLoad_kg / tests::kMass_kg) * half_s),
                1e-7);
    const double both_kg_m_s =
        (tests::kMass_kg + kLoad_kg) * carried.state[kVelocity] + kLoad_kg * carried.swing_m_s();
    EXPECT_NEAR(both_kg_m_s, 0, 1e-9);
    EXPECT_NEAR(carried.state[kPosition + 2], 1, 1e-5) << "the thrust carries both";
  }
}

TEST(Pendulum, LargeSwingsKeepEnergyMomentumAndTheLengthOfTheString) {
  // Two bodies connected by a string, under gravity and a thrust that carries both: only friction dissipates energy.
  CarriedLoad carried(kString_m, 0.01);
  const double angle = 1;
  carried.swing_m() = kString_m * std::sin(angle);
  carried.state[kVehicleStateSize + 2] = kString_m * (1 - std::cos(angle));
  const double both_kg = tests::kMass_kg + kLoad_kg;
  const auto energy_J = [&] {
    const double* const x = carried.state.data();
    const Eigen::Vector3d v(x[kVelocity], x[kVelocity + 1], x[kVelocity + 2]);
    const Eigen::Vector3d dr(x[kVehicleStateSize + 3], x[kVehicleStateSize + 4], x[kVehicleStateSize + 5]);
    const double z_m = x[kPosition + 2], load_z_m = z_m - kString_m + x[kVehicleStateSize + 2];
    return 0.5 * tests::kMass_kg * v.squaredNorm() + 0.5 * kLoad_kg * (v + dr).squaredNorm() +
           kGravity_m_s2 * (tests::kMass_kg * z_m + kLoad_kg * load_z_m - both_kg * z_m);
  };
  const double before_J = energy_J();
  double largest_m_s = 0;
  for (int k = 0; k < 100; ++k) {
    carried.move(0.01);
    largest_m_s = std::max(largest_m_s, std::abs(carried.swing_m_s()));
    const double down_m = kString_m - carried.state[kVehicleStateSize + 2];
    ASSERT_NEAR(std::hypot(carried.swing_m(), down_m), kString_m, 1e-6);
    ASSERT_NEAR(both_kg * carried.state[kVelocity] + kLoad_kg * carried.swing_m_s(), 0, 1e-9);
  }
  EXPECT_GT(largest_m_s, 1);
  const double swing_J = kLoad_kg * kGravity_m_s2 * kString_m * (1 - std::cos(angle));
  EXPECT_LT(energy_J(), before_J);
  EXPECT_GT(energy_J(), before_J - 0.02 * swing_J) << "friction takes 1 % a second";
}

TEST(Pendulum, ClimbsAsOneBodyOfBothMasses) {
  CarriedLoad carried(kString_m, 0.1);
  carried.input.disturbance_W_N = {0, 0, 0.02};
  carried.move(0.5);
  EXPECT_NEAR(carried.state[kVelocity + 2], 0.5 * 0.02 / (tests::kMass_kg + kLoad_kg), 1e-9);
}

TEST(Pendulum, HangsAsideUnderConstantAcceleration) {
  // After the swing has decayed, the string points along the load's apparent gravity.
  CarriedLoad carried(kString_m, 6);
  carried.input.disturbance_W_N = {0.1, 0, 0};
  carried.move(20);
  const double angle = std::atan(0.1 / (tests::kMass_kg + kLoad_kg) / kGravity_m_s2);
  EXPECT_NEAR(carried.swing_m(), -kString_m * std::sin(angle), 1e-9);
  EXPECT_NEAR(carried.state[kVehicleStateSize + 2], kString_m * (1 - std::cos(angle)), 1e-9);
}

TEST(Pendulum, ColumnsAlongALogAreTheSimulatedForce) {
  CarriedLoad carried(kString_m, 0.3);
  const Model model = carried.swarm.model(0);
  const AppliedEffect applied(model.effects[0], {model.kind, {model.kind}, model.path});
  const auto stream = applied.effect().stream(applied.shape().data());
  double largest_N = 0, apart_N = 0, apart_z_N = 0;
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    carried.input.disturbance_W_N = {0.03 * std::sin(4.3 * t), 0.02 * std::sin(6 * t),
                                     0.02 * std::sin(2 * t)};
    const Wrench force = carried.swarm.effects_on(0, t, carried.state.data(), carried.input);
    Instant now = carried.swarm.instant(0, t, carried.state.data(), carried.input);
    Wrench column;
    stream->advance(now, &column);
    const Eigen::Vector3d error_N =
        kLoad_kg * column.force_W_N - (force.force_W_N - carried.input.disturbance_W_N);
    largest_N = std::max(largest_N, kLoad_kg * column.force_W_N.head<2>().norm());
    apart_N = std::max(apart_N, error_N.head<2>().norm());
    apart_z_N = std::max(apart_z_N, std::abs(error_N.z()));
    carried.move(0.01);
  }
  EXPECT_GT(largest_N, 0.008) << "it must swing";
  EXPECT_LT(apart_N, 0.015 * largest_N);
  EXPECT_LT(apart_z_N, 7e-4) << "the acceleration in the tension is 0.04 s late";
}

TEST(Pendulum, ForgetsTheSwingAtAGapOfTheLog) {
  const Pendulum pendulum;
  const double shape[] = {kString_m, 0.1};
  const auto stream = pendulum.stream(shape);
  Instant now;
  Wrench column;
  stream->advance(now, &column);
  now.time_s = 0.02;
  now.v_W_m_s = {0.5, 0, 0};
  stream->advance(now, &column);
  now.time_s = 0.04;
  stream->advance(now, &column);
  EXPECT_LT(column.force_W_N.x(), -0.1);
  stream->restart();
  stream->advance(now, &column);
  EXPECT_EQ(column.force_W_N, Eigen::Vector3d(0, 0, -kGravity_m_s2));
}

/// Returns the largest distance between a sampled and a continuous flight of the vehicle with the load.
double gap_m(double rate_hz, double* swing_m) {
  const Gains gains = parse_gains(
      "schema = \"swarmcert/gains/1\"\n[position]\nKp = [20, 20, 10]\nKd = [10, 10, 5]\nKi = [3, 3, 10]\n"
      "[attitude]\nlaw = \"lee\"\n",
      "gains.toml");
  const auto task = make_task("swap", {2, 9, 0});
  Swarm swarm(with_load(kLoad_kg, kString_m, 0.3), 2), twin(with_load(kLoad_kg, kString_m, 0.3), 2);
  ContinuousFlight flight(swarm, gains, *task, {});
  SampledFlightOptions options;
  options.attitude_rate_hz = rate_hz;
  options.flies_float = false;
  options.battery_drop_V_s = 0;
  SampledFlight sampled(twin, gains, *task, options);
  double gap = 0;
  for (int k = 1; k <= 40; ++k) {
    flight.advance(0.1 * k);
    while (sampled.time_s() < 0.1 * k - 1e-9) sampled.step();
    for (int axis = 0; axis < 3; ++axis)
      gap = std::max(gap, std::abs(flight.state(0)[axis] - sampled.state()[axis]));
    *swing_m = std::max(*swing_m, std::abs(sampled.state()[2 * kVehicleStateSize]));
  }
  return gap;
}

TEST(Pendulum, SwingsAlikeInTheSampledAndTheContinuousLoop) {
  double swing_m = 0;
  const double coarse_m = gap_m(500, &swing_m), fine_m = gap_m(2000, &swing_m);
  EXPECT_GT(swing_m, 0.01);
  EXPECT_LT(coarse_m, 3e-3);
  EXPECT_LT(fine_m, 0.4 * coarse_m) << "first order in the period";
}

TEST(Pendulum, HasNoTruthBoundsAndSaysWhy) {
  const std::vector<EffectBounds> bounds = truth_bounds(with_load(kLoad_kg, kString_m, 0.1), MotionSet());
  ASSERT_EQ(bounds.size(), 1u);
  EXPECT_EQ(bounds[0].effect, "pendulum");
  EXPECT_TRUE(std::isinf(bounds[0].amplitude_N[0]));
  EXPECT_NE(bounds[0].unbounded.find("swing"), std::string::npos);
}

}  // namespace
}  // namespace swarmcert::stability

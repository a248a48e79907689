#include "controller/flight_controller.h"

#include <gtest/gtest.h>

#include <limits>

#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

class FlightTest : public testing::Test {
 protected:
  FlightTest() {
    settings_.mass_kg = 0.034f;
    settings_.inertia_kg_m2 = diagonal(Vector3<float>{16.57e-6f, 16.66e-6f, 29.26e-6f});
    settings_.position = {{20, 20, 10}, {10, 10, 5}, {3, 3, 10}};
    settings_.integrator = {{0.1f, 0.1f, 0.1f}, 0.01f};
    settings_.robust = {{10, 10, 4}, {5e-4f, 5e-4f, 1e-3f}, {2.5e-4f, 2.5e-4f, 5e-4f}, {2, 2, 2}};
    settings_.attitude_step_s = 0.002f;
    settings_.allocation = allocation(crazyflie_rotors(0.046f, 0.006f));
    settings_.thrust_map = {11.0933585f, -39.0810417f, -9.5256471f, 20.5733023f, 38.4288507f};
    settings_.largest_force = {-9.8557744f, 3.0164757f, 26.7163688f, 8.0f, 25.0f};
    settings_.idle_force_N = 0.005f;
    measured_.attitude.R_WB = identity<float>();
    measured_.position_stamp_ms = measured_.attitude_stamp_ms = kNow_ms;
    measured_.battery_V = 3.9f;
  }

  FlightCommand<float> step() {
    return flight_step(settings_, memory_, measured_, reference_, effect_, kNow_ms, true, torque_effect_);
  }

  static constexpr std::uint32_t kNow_ms = 5000;
  FlightSettings<float, PidGains<float>> settings_{};
  FlightMemory<float> memory_;
  Measured<float> measured_{};
  FlightReference<float> reference_{};
  Vector3<float> effect_{}, torque_effect_{};
};

TEST_F(FlightTest, HoverGivesTheWeightToFourEqualMotors) {
  const FlightCommand<float> command = step();
  EXPECT_EQ(command.faults, kNoFault);
  EXPECT_NEAR(command.wanted.thrust_N, 0.034 * 9.81, 1e-6);
  EXPECT_EQ(norm(command.wanted.torque_N_m), 0.0f);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(command.pwm[i], command.pwm[0]);
    EXPECT_NEAR(force_of_pwm(settings_.thrust_map, static_cast<float>(command.pwm[i]) / 65536.0f, 3.9f),
                0.034 * 9.81 / 4, 1e-5);
  }
  for (int i = 4; i < kMostRotors; ++i) EXPECT_EQ(command.pwm[i], 0);
}

TEST_F(FlightTest, BadPositionsGiveALevelDescent) {
  const auto expect_descent = [&] {
    memory_ = {};
    const FlightCommand<float> command = step();
    EXPECT_EQ(command.faults & kPositionFault, kPositionFault);
    EXPECT_FALSE(command.motors_off);
    EXPECT_NEAR(command.wanted.thrust_N, 0.9 * 0.034 * 9.81, 1e-5);
    EXPECT_EQ(norm(command.wanted.torque_N_m), 0.0f) << "level";
    EXPECT_EQ(norm(memory_.integral_m_s), 0.0f);
  };
  const Measured<float> good = measured_;
  measured_.position_W_m.y = kNaN, expect_descent(), measured_ = good;
  measured_.velocity_W_m_s.z = 1e9f, expect_descent(), measured_ = good;
  measured_.position_stamp_ms = kNow_ms - 101, expect_descent(), measured_ = good;
  reference_.position_W_m.x = kNaN, expect_descent();  // and there has been no valid setpoint before
}

TEST_F(FlightTest, BadAttitudesStopTheMotors) {
  const auto expect_off = [&] {
    const FlightCommand<float> command = step();
    EXPECT_EQ(command.faults & kAttitudeFault, kAttitudeFault);
    EXPECT_TRUE(command.motors_off);
    for (const std::uint16_t pwm : command.pwm) EXPECT_EQ(pwm, 0);
  };
  const Measured<float> good = measured_;
  measured_.attitude.omega_B_rad_s.x = kNaN, expect_off(), measured_ = good;
  measured_.attitude.R_WB.x.y = kNaN, expect_off(), measured_ = good;
  measured_.attitude.R_WB = diagonal(Vector3<float>{1, 1, -1}), expect_off(),
  measured_ = good;  // a reflection
  measured_.attitude.R_WB = diagonal(Vector3<float>{1.1f, 1, 1}), expect_off(), measured_ = good;
  measured_.attitude_stamp_ms = kNow_ms - 21, expect_off(), measured_ = good;
}

TEST_F(FlightTest, BadReferencesKeepTheLastPosition) {
  reference_.position_W_m = {0, 0, 0.1f};
  reference_.velocity_W_m_s = {0, 0, 0.5f};
  step();
  reference_.acceleration_W_m_s2.x = kNaN;
  settings_.integrator.step_s = 0;
  const FlightCommand<float> command = step();
  EXPECT_EQ(command.faults, kReferenceFault);
  // Kp pulls towards the last position; the reference velocity is zero.
  EXPECT_NEAR(command.force_W_N.z, 0.034f * (9.81f + 10 * 0.1f - 10 * memory_.integral_m_s.z), 1e-5);
  EXPECT_NEAR(command.force_W_N.x, 0, 1e-7);
}

TEST_F(FlightTest, BadPredictionsAreLeftOut) {
  effect_ = {0, 0, kNaN};
  EXPECT_EQ(step().faults, kPredictionFault);
  EXPECT_NEAR(step().wanted.thrust_N, 0.034 * 9.81, 1e-6);
  effect_ = {0, 0, 100};
  EXPECT_EQ(step().faults, kPredictionFault);
  effect_ = {0, 0, -0.05f};
  EXPECT_EQ(step().faults, kNoFault);
  EXPECT_NEAR(step().wanted.thrust_N, 0.034 * 9.81 + 0.05, 1e-6);
}

TEST_F(FlightTest, PredictedTorquesAreTakenFromWhatIsAskedForUnlessTheyAreBad) {
  torque_effect_ = {1e-4f, -2e-4f, 5e-5f};
  const FlightCommand<float> command = step();
  EXPECT_EQ(command.faults, kNoFault);
  EXPECT_EQ(command.wanted.torque_N_m.x, -1e-4f);
  EXPECT_EQ(command.wanted.torque_N_m.y, 2e-4f);
  EXPECT_EQ(command.wanted.torque_N_m.z, -5e-5f);
  for (const float bad : {kNaN, 1.0f}) {
    torque_effect_.y = bad;
    EXPECT_EQ(step().faults, kPredictionFault);
    EXPECT_EQ(norm(step().wanted.torque_N_m), 0.0f);
  }
}

TEST_F(FlightTest, BadVoltagesAreReplacedByALowOne) {
  const int at_full = step().pwm[0];
  measured_.battery_V = kNaN;
  const FlightCommand<float> command = step();
  EXPECT_EQ(command.faults, kBatteryFault);
  EXPECT_GT(command.pwm[0], at_full);
}

// All inputs at once may be arbitrary: the output is still within range and the memory stays finite.
TEST_F(FlightTest, NothingThatComesInGetsThrough) {
  std::mt19937 generator(30);
  const float strange[] = {kNaN,
                           std::numeric_limits<float>::infinity(),
                           -std::numeric_limits<float>::infinity(),
                           3e38f,
                           -3e38f,
                           1e-45f,
                           0.0f,
                           -0.0f,
                           1.0f};
  int flown = 0;
  for (int i = 0; i < 20000; ++i) {
    // Start from valid random inputs and overwrite up to two of their numbers.
    Measured<float> m = measured_;
    FlightReference<float> r = reference_;
    Vector3<float> e = effect_;
    m.position_W_m = tests::cast<float>(tests::random_vector(generator, 1));
    m.attitude.R_WB = tests::cast<float>(
        tests::rotation(tests::random_unit_vector(generator), tests::uniform(generator, 0, 3.14)));
    m.attitude.omega_B_rad_s = tests::cast<float>(tests::random_vector(generator, 20));
    float* const targets[] = {&m.position_W_m.x,
                              &m.velocity_W_m_s.y,
                              &m.attitude.R_WB.y.z,
                              &m.attitude.omega_B_rad_s.z,
                              &m.battery_V,
                              &r.position_W_m.z,
                              &r.acceleration_W_m_s2.x,
                              &r.heading.sine,
                              &r.omega_R_rad_s.y,
                              &r.omega_dot_R_rad_s2.x,
                              &e.z};
    for (int n = static_cast<int>(generator() % 3); n > 0; --n) {
      *targets[generator() % std::size(targets)] = strange[generator() % std::size(strange)];
    }
    const FlightCommand<float> command = flight_step(settings_, memory_, m, r, e, kNow_ms, i % 5 == 0);
    ASSERT_TRUE(is_finite(memory_.integral_m_s) && is_finite(memory_.force_W_N) && is_finite(memory_.R_WR));
    ASSERT_TRUE(is_finite(memory_.rate_integral_rad));
    ASSERT_TRUE(is_rotation(memory_.R_WR, 1e-5f));
    flown += !command.motors_off;
    if (command.motors_off) continue;
    for (int k = 0; k < 4; ++k) {
      ASSERT_GE(command.mixed.forces.at_N[k], 0.005f);
      ASSERT_LE(command.mixed.forces.at_N[k], 25 * 9.81e-3f);
    }
  }
  EXPECT_GT(flown, 10000);
}

TEST_F(FlightTest, SaturatedThrustStopsTheIntegralAndReleasesIt) {
  settings_.integrator.limit_m_s = {10, 10, 10};
  reference_.position_W_m.z = 5;  // far below the setpoint: needs more thrust than is available
  for (int i = 0; i < 200; ++i) step();
  EXPECT_LE(std::fabs(memory_.integral_m_s.z), 0.051f) << "one step before saturation was known";
  reference_.position_W_m.z = -0.1f;
  step();
  step();
  EXPECT_GT(memory_.integral_m_s.z, -0.05f);
}

}  // namespace
}  // namespace swarmcert::controller

#include "controller/battery.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

// Coefficients published with the paper's flights (aerorobotics/neural-swarm), for small vehicles.
constexpr ThrustMap<double> kThrust{11.093358483549203, -39.08104165843915, -9.525647087583181,
                                    20.573302305476638, 38.42885066644033};
constexpr LargestForceMap<double> kLargest{-9.855774395877377, 3.0164756915292554, 26.716368783384496, 8.0,
                                           25.0};

ThrustMap<float> in_float(const ThrustMap<double>& m) {
  return {static_cast<float>(m.c00), static_cast<float>(m.c10), static_cast<float>(m.c01),
          static_cast<float>(m.c20), static_cast<float>(m.c11)};
}

TEST(Battery, PwmOfForceOfPwmIsThePwm) {
  std::mt19937 generator(13);
  const ThrustMap<float> map = in_float(kThrust);
  int tried = 0;
  for (int i = 0; i < 20000; ++i) {
    const double p = tests::uniform(generator, 0, 1), volts = tests::uniform(generator, 3.0, 4.2);
    const double v = volts / 4.2;
    // Only the rising branch, where the polynomial models a propeller.
    if (kThrust.c10 + kThrust.c11 * v + 2 * kThrust.c20 * p < 2.0) continue;
    const double force = force_of_pwm(kThrust, p, volts);
    if (force <= 0) continue;
    ++tried;
    EXPECT_NEAR(pwm_of_force(kThrust, force, volts), p, 1e-12);
    const auto force_f = force_of_pwm(map, static_cast<float>(p), static_cast<float>(volts));
    EXPECT_NEAR(pwm_of_force(map, force_f, static_cast<float>(volts)), p, 2e-5);
  }
  EXPECT_GT(tried, 10000);
}

// Below 4 gf the published polynomial is not a valid model: there it decreases with PWM and voltage.
TEST(Battery, PwmGrowsWithForceAndFallsWithVoltage) {
  double last = 0;
  for (double force = 0.04; force < 0.14; force += 0.005) {
    const double p = pwm_of_force(kThrust, force, 3.9);
    EXPECT_GT(p, last);
    EXPECT_LT(p, pwm_of_force(kThrust, force, 3.7));
    last = p;
  }
}

// The paper's flights logged a maximum force of 12.4 to 16.8 gf per motor.
TEST(Battery, LargestForceFollowsVoltageWithinItsLimits) {
  EXPECT_NEAR(largest_force(kLargest, 0.7, 3.8) / kNewtonPerGramForce, 16.4, 0.1);
  EXPECT_LT(largest_force(kLargest, 0.7, 3.4), largest_force(kLargest, 0.7, 3.8));
  EXPECT_EQ(largest_force(kLargest, 0.7, 0.0), 8.0 * kNewtonPerGramForce);
  EXPECT_EQ(largest_force(kLargest, 0.7, 9.0), 25.0 * kNewtonPerGramForce);
}

TEST(Battery, ForcesOutOfReachGiveTheEndsOfTheRange) {
  EXPECT_EQ(pwm_of_force(kThrust, -0.1, 3.9), 0.0);
  EXPECT_EQ(pwm_of_force(kThrust, 10.0, 3.9), 1.0);
  EXPECT_EQ(pwm_of_force(kThrust, 0.0, 3.9), 0.0);
  EXPECT_EQ(pwm_of_force(kThrust, std::nan(""), 3.9), 0.0);
  // A parabola that opens downwards cannot exceed its maximum.
  EXPECT_EQ(pwm_of_force(ThrustMap<double>{0, 20, 0, -10, 0}, 0.2, 4.2), 1.0);
  EXPECT_NEAR(pwm_of_force(ThrustMap<double>{0, 20, 0, -10, 0}, 7.5 * kNewtonPerGramForce, 4.2), 0.5, 1e-12);
}

TEST(PwmRegister, IsDefinedForEveryFloat) {
  EXPECT_EQ(pwm_register(0.0f), 0);
  EXPECT_EQ(pwm_register(0.5f), 32768);
  EXPECT_EQ(pwm_register(1.0f), 65535);
  EXPECT_EQ(pwm_register(3e9f), 65535);
  EXPECT_EQ(pwm_register(std::numeric_limits<float>::infinity()), 65535);
  EXPECT_EQ(pwm_register(-1.0f), 0);
  EXPECT_EQ(pwm_register(-std::numeric_limits<float>::infinity()), 0);
  EXPECT_EQ(pwm_register(std::numeric_limits<float>::quiet_NaN()), 0);
}

}  // namespace
}  // namespace swarmcert::controller

#include "controller/position_law.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

constexpr double kMass_kg = 0.034;

struct Situation {
  TrackingError<double> error;
  Vector3<double> integral_m_s;
  FeedForward<double> feed_forward;
};

Situation random_situation(std::mt19937& generator) {
  return {{tests::random_vector(generator, 0.5), tests::random_vector(generator, 1.0)},
          tests::random_vector(generator, 0.2),
          {tests::random_vector(generator, 2.0), tests::random_vector(generator, 0.1)}};
}

// The closed loop analysed by the theorem: with f_d applied to the mass, m s_dot = -K s - (f_a_hat - f_a).
TEST(PositionLaw, CompositeVariableObeysTheClosedLoopOfThePaper) {
  std::mt19937 generator(2);
  for (int i = 0; i < 200; ++i) {
    const Situation now = random_situation(generator);
    // Intentionally coupled axes.
    const CompositeGains<double> gains{{{4, 0.5, 0}, {0.5, 3, 0.2}, {0, 0.2, 5}},
                                       {{0.2, 0.01, 0}, {0.01, 0.3, 0}, {0, 0, 0.15}}};
    const Vector3<double> effect_N = tests::random_vector(generator, 0.1);
    const Vector3<double> force =
        desired_force(gains, kMass_kg, now.error, now.integral_m_s, now.feed_forward);
    const Vector3<double> acceleration =
        divided(force + effect_N, kMass_kg) - Vector3<double>{0, 0, kGravity_m_s2};
    const Matrix3<double>& l = gains.Lambda_1_s;
    const Vector3<double> s =
        now.error.velocity_m_s + scaled(2.0, l * now.error.position_m) + l * (l * now.integral_m_s);
    const Vector3<double> s_dot = acceleration - now.feed_forward.acceleration_m_s2 +
                                  scaled(2.0, l * now.error.velocity_m_s) + l * (l * now.error.position_m);
    const Vector3<double> residual =
        scaled(kMass_kg, s_dot) + gains.K_kg_s * s + (now.feed_forward.predicted_effect_N - effect_N);
    EXPECT_LE(norm(residual), 1e-14);
  }
}

TEST(PositionLaw, HoverWithoutErrorCarriesTheWeightLessThePredictedEffect) {
  const PidGains<double> gains{{20, 20, 10}, {10, 10, 5}, {3, 3, 10}};
  const Vector3<double> force = desired_force(gains, kMass_kg, {}, {}, {{}, {0, 0, -0.05}});
  EXPECT_EQ(force.x, 0.0);
  EXPECT_EQ(force.y, 0.0);
  EXPECT_DOUBLE_EQ(force.z, kMass_kg * kGravity_m_s2 + 0.05);
}

TEST(PositionLaw, IntegralStopsAtItsLimitAndLeavesItAtOnce) {
  const Integrator<float> integrator{{0.1f, 0.1f, 0.1f}, 0.01f};
  Vector3<float> integral{};
  for (int i = 0; i < 1000; ++i) integral = integrate(integrator, integral, {0.5f, -0.5f, 0.0f});
  EXPECT_EQ(integral.x, 0.1f);
  EXPECT_EQ(integral.y, -0.1f);
  EXPECT_EQ(integral.z, 0.0f);
  integral = integrate(integrator, integral, {-0.5f, 0.5f, 0.0f});
  EXPECT_FLOAT_EQ(integral.x, 0.095f);
  EXPECT_FLOAT_EQ(integral.y, -0.095f);
}

TEST(PositionLaw, InfiniteLimitIsNoLimit) {
  const double infinite = std::numeric_limits<double>::infinity();
  const Integrator<double> integrator{{infinite, infinite, infinite}, 1.0};
  const Vector3<double> integral = integrate(integrator, {1e6, 0, 0}, {1.0, 2.0, 3.0});
  EXPECT_EQ(integral.x, 1e6 + 1.0);
  EXPECT_EQ(integral.z, 3.0);
}

// Windup: the vehicle is too low, the thrust is saturated, and integrating the error would increase the demand further.
TEST(PositionLaw, SaturatedThrustHoldsOnlyTheAxesThatWouldPushFurther) {
  const PidGains<double> gains{{20, 20, 10}, {10, 10, 5}, {3, 3, 10}};
  const Vector3<double> error{0.2, -0.1, -0.3}, force{0.05, 0.1, 0.6};
  const HeldAxes held = held_axes(gains, error, force, true);
  EXPECT_FALSE(held.x);  // an error in +x pushes towards -x, against the force
  EXPECT_TRUE(held.y);
  EXPECT_TRUE(held.z);
  const HeldAxes free = held_axes(gains, error, force, false);
  EXPECT_FALSE(free.x || free.y || free.z);

  const Integrator<double> integrator{{1, 1, 1}, 0.01};
  const Vector3<double> before{0.01, 0.02, 0.03};
  const Vector3<double> after = integrate(integrator, before, error, held);
  EXPECT_GT(after.x, before.x);
  EXPECT_EQ(after.y, before.y);
  EXPECT_EQ(after.z, before.z);
}

TEST(PositionLaw, CoupledGainsHoldTheWholeIntegral) {
  const CompositeGains<double> gains{diagonal(Vector3<double>{4, 4, 4}),
                                     diagonal(Vector3<double>{.2, .2, .2})};
  EXPECT_TRUE(held_axes(gains, {0.0, 0.0, -0.3}, {0.0, 0.0, 0.6}, true).x);
  EXPECT_FALSE(held_axes(gains, {0.0, 0.0, 0.3}, {0.0, 0.0, 0.6}, true).z);
}

}  // namespace
}  // namespace swarmcert::controller

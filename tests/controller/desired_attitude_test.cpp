#include "controller/desired_attitude.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

constexpr float kSmallest_N = 1e-3f;

TEST(DesiredAttitude, IsARotationThatPushesAlongTheForceWithTheNoseInTheHeadingsPlane) {
  std::mt19937 generator(5);
  int inverted = 0, parallel = 0;
  for (int i = 0; i < 20000; ++i) {
    const double yaw = tests::uniform(generator, -4, 4);
    const Heading<float> heading = heading_of_yaw(static_cast<float>(yaw));
    Vector3<double> direction = tests::random_unit_vector(generator);
    if (i % 10 == 0) {  // close to the heading, on all sides
      direction = Vector3<double>{std::cos(yaw), std::sin(yaw), 0} +
                  scaled(tests::uniform(generator, 0, 0.02), tests::random_unit_vector(generator));
    }
    const auto force =
        tests::cast<float>(scaled(tests::uniform(generator, 0.01, 1) / norm(direction), direction));
    const DesiredAttitude<float> desired = desired_attitude(force, heading, identity<float>(), kSmallest_N);
    ASSERT_TRUE(is_rotation(desired.R_WR, 1e-6f))
        << "yaw " << yaw << ", force " << force.x << " " << force.y << " " << force.z;
    EXPECT_LE(norm(divided(force, norm(force)) - z_axis(desired.R_WR)), 1e-6f);
    inverted += force.z < 0;
    if (desired.which == AttitudeCase::kHeadingParallel) {
      ++parallel;
      continue;
    }
    ASSERT_EQ(desired.which, AttitudeCase::kRegular);
    // y_d is horizontal and perpendicular to the heading: y_d . x_c = 0. The nose does not point backwards.
    const Vector3<float> x_c{heading.cosine, heading.sine, 0};
    const Matrix3<float> axes = transpose(desired.R_WR);
    EXPECT_NEAR(dot(axes.y, x_c), 0, 1e-4);
    EXPECT_GE(dot(axes.x, x_c), 0);
  }
  EXPECT_GT(inverted, 5000);
  EXPECT_GT(parallel, 100);
}

TEST(DesiredAttitude, UprightHoverLooksAlongTheHeading) {
  const DesiredAttitude<double> desired =
      desired_attitude<double>({0, 0, 0.3}, heading_of_yaw(1.0), identity<double>(), 1e-3);
  EXPECT_LE(tests::largest_entry(tests::difference(desired.R_WR, tests::rotation({0, 0, 1}, 1.0))), 1e-13);
}

// In inverted flight the nose keeps its direction: x_d is unchanged, y_d and z_d change sign.
TEST(DesiredAttitude, InvertedFlightKeepsTheNose) {
  const DesiredAttitude<double> desired =
      desired_attitude<double>({0, 0, -0.3}, heading_of_yaw(0.5), identity<double>(), 1e-3);
  const Matrix3<double> axes = transpose(desired.R_WR);
  EXPECT_NEAR(axes.x.x, std::cos(0.5), 1e-13);
  EXPECT_NEAR(axes.x.y, std::sin(0.5), 1e-13);
  EXPECT_EQ(axes.z.z, -1.0);
}

TEST(DesiredAttitude, ParallelThrustMeetsTheRegularCaseFromAbove) {
  const Heading<double> heading = heading_of_yaw(0.7);
  const auto attitude = [&](double above_rad) {
    return attitude_of_axis<double>(
        {heading.cosine * std::cos(above_rad), heading.sine * std::cos(above_rad), std::sin(above_rad)},
        heading);
  };
  const DesiredAttitude<double> regular = attitude(1.001 * kParallel), singular = attitude(0.999 * kParallel);
  EXPECT_EQ(regular.which, AttitudeCase::kRegular);
  EXPECT_EQ(singular.which, AttitudeCase::kHeadingParallel);
  EXPECT_LE(tests::largest_entry(tests::difference(regular.R_WR, singular.R_WR)), 3e-3 * kParallel);
}

TEST(DesiredAttitude, TooSmallAForceKeepsTheLastDirection) {
  const Matrix3<float> last = tests::cast<float>(tests::rotation({0, 1, 0}, 0.4));
  for (const float z : {0.0f, 5e-4f, -5e-4f}) {
    const DesiredAttitude<float> desired = desired_attitude<float>({0, 0, z}, {}, last, kSmallest_N);
    EXPECT_EQ(desired.which, AttitudeCase::kForceTooSmall);
    EXPECT_LE(norm(z_axis(desired.R_WR) - z_axis(last)), 1e-6f);
    EXPECT_TRUE(is_rotation(desired.R_WR, 1e-6f));
  }
}

// The bounds assume that |T R e_z - f_d| is at most |f_d| sin(angle), or 2 |f_d| sin(angle / 2), for the two rules.
TEST(CollectiveThrust, MissesTheForceByAtMostTheStatedShare) {
  std::mt19937 generator(6);
  for (int i = 0; i < 2000; ++i) {
    const Vector3<double> force =
        scaled(tests::uniform(generator, 0.1, 1), tests::random_unit_vector(generator));
    const Vector3<double> axis = tests::random_unit_vector(generator);
    const Matrix3<double> attitude = attitude_of_axis(divided(force, norm(force)), Heading<double>{}).R_WR *
                                     tests::rotation(axis, tests::uniform(generator, 0, 1.5));
    const double cosine = dot(force, z_axis(attitude)) / norm(force);
    const double angle = std::acos(std::fmin(1.0, cosine));
    for (const ThrustRule rule : {ThrustRule::kProjected, ThrustRule::kMagnitude}) {
      const double thrust = collective_thrust(rule, force, attitude);
      const double share = rule == ThrustRule::kProjected ? std::sin(angle) : 2 * std::sin(angle / 2);
      EXPECT_LE(norm(scaled(thrust, z_axis(attitude)) - force), norm(force) * share + 1e-7);
    }
  }
}

TEST(CollectiveThrust, IsNeverNegative) {
  EXPECT_EQ(collective_thrust<float>(ThrustRule::kProjected, {0, 0, -1}, identity<float>()), 0.0f);
}

}  // namespace
}  // namespace swarmcert::controller

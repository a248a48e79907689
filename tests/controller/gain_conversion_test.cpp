#include "controller/gain_conversion.h"

#include <gtest/gtest.h>

#include <random>

#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

constexpr double kVehicleMass_kg = 0.034;

AxisComposite<double> convert(double kp, double kd, double ki) {
  return to_composite(AxisPid<double>{kp, kd, ki}, kVehicleMass_kg, 1e-6);
}

TEST(GainConversion, ThereAndBackReturnsTheGains) {
  std::mt19937 generator(3);
  for (int i = 0; i < 1000; ++i) {
    const double lambda = tests::uniform(generator, 0.1, 10), k = tests::uniform(generator, 0.01, 1);
    const AxisPid<double> pid = to_pid(lambda, k, kVehicleMass_kg);
    const AxisComposite<double> back = to_composite(pid, kVehicleMass_kg, 1e-9);
    ASSERT_EQ(back.status, ConversionStatus::kOk) << lambda << " " << k;
    EXPECT_NEAR(back.lambda_1_s, lambda, 1e-7 * lambda);
    EXPECT_NEAR(back.k_kg_s, k, 1e-6 * k);
  }
}

TEST(GainConversion, BothFormsGiveTheSameForce) {
  std::mt19937 generator(4);
  for (int i = 0; i < 200; ++i) {
    const Vector3<double> lambda = Vector3<double>{1, 1, 1} + scaled(0.5, tests::random_vector(generator, 1));
    const Vector3<double> k = Vector3<double>{.2, .2, .2} + scaled(0.1, tests::random_vector(generator, 1));
    const CompositeGains<double> composite{diagonal(lambda), diagonal(k)};
    const AxisPid<double> x = to_pid(lambda.x, k.x, kVehicleMass_kg),
                          y = to_pid(lambda.y, k.y, kVehicleMass_kg),
                          z = to_pid(lambda.z, k.z, kVehicleMass_kg);
    const PidGains<double> pid{
        {x.Kp_1_s2, y.Kp_1_s2, z.Kp_1_s2}, {x.Kd_1_s, y.Kd_1_s, z.Kd_1_s}, {x.Ki_1_s3, y.Ki_1_s3, z.Ki_1_s3}};
    const TrackingError<double> error{tests::random_vector(generator, 0.5),
                                      tests::random_vector(generator, 1)};
    const Vector3<double> integral = tests::random_vector(generator, 0.2);
    const FeedForward<double> forward{tests::random_vector(generator, 2),
                                      tests::random_vector(generator, 0.1)};
    const Vector3<double> gap = desired_force(composite, kVehicleMass_kg, error, integral, forward) -
                                desired_force(pid, kVehicleMass_kg, error, integral, forward);
    EXPECT_LE(norm(gap), 1e-14);
  }
}

// s^3 + Kd s^2 + Kp s + Ki = (s + a)(s + l)^2 has a triple root for l = a; then both candidates for Lambda coincide.
TEST(GainConversion, TripleRootConverts) {
  const AxisPid<double> pid = to_pid(4.0, 4.0 * kVehicleMass_kg, kVehicleMass_kg);
  EXPECT_DOUBLE_EQ(pid.Kp_1_s2, 48.0);
  EXPECT_DOUBLE_EQ(pid.Kd_1_s, 12.0);
  EXPECT_DOUBLE_EQ(pid.Ki_1_s3, 64.0);
  const AxisComposite<double> back = to_composite(pid, kVehicleMass_kg, 1e-9);
  EXPECT_EQ(back.status, ConversionStatus::kOk);
  EXPECT_NEAR(back.lambda_1_s, 4.0, 1e-4);
}

// The force of the law with gains in newton is the mass it is told times that of the PID gains.
TEST(GainConversion, GainsInNewtonGiveTheSameForce) {
  const AxisForceGains<double> gains = {0.4, 0.2, 0.05};
  constexpr double kTold_kg = 0.027, kError_m = 0.3, kError_m_s = -0.7, kIntegral_m_s = 0.11;
  const AxisPid<double> pid = to_pid(gains, kTold_kg);
  EXPECT_DOUBLE_EQ(
      kTold_kg * (pid.Kp_1_s2 * kError_m + pid.Kd_1_s * kError_m_s + pid.Ki_1_s3 * kIntegral_m_s),
      gains.kp_N_m * kError_m + gains.kd_N_s_m * kError_m_s + gains.ki_N_ms * kIntegral_m_s);
}

// Expected values: real roots of 3 l^2 - 2 Kd l + Kp = 0, and Ki = (Kd - 2 l) l^2, for the gains published with the
// paper and the defaults of the firmware.
TEST(GainConversion, PublishedGainsAreNotOfTheTheoremsForm) {
  EXPECT_EQ(convert(10, 5, 10).status, ConversionStatus::kNoDoubleRoot);
  const AxisComposite<double> xy = convert(20, 10, 3);
  EXPECT_EQ(xy.status, ConversionStatus::kOtherIntegralGain);
  EXPECT_NEAR(xy.lambda_1_s, 1.2251, 5e-5);
  EXPECT_NEAR(xy.needed_Ki_1_s3, 11.33, 5e-3);
  const AxisComposite<double> firmware = convert(12, 8, 8);
  EXPECT_EQ(firmware.status, ConversionStatus::kOtherIntegralGain);
  EXPECT_NEAR(firmware.lambda_1_s, 0.9028, 5e-5);
  EXPECT_NEAR(firmware.needed_Ki_1_s3, 5.05, 5e-3);
}

TEST(GainConversion, RefusesWhatHasNoSuchForm) {
  EXPECT_EQ(convert(10, 5, 0).status, ConversionStatus::kNotPositive);
  EXPECT_EQ(convert(-10, 5, 1).status, ConversionStatus::kNotPositive);
  EXPECT_EQ(convert(std::nan(""), 5, 1).status, ConversionStatus::kNotPositive);
  EXPECT_EQ(to_composite(AxisPid<double>{10, 10, 1}, 0.0, 1e-6).status, ConversionStatus::kMassNotPositive);
}

}  // namespace
}  // namespace swarmcert::controller

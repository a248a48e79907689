#include "stability/gains.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nn/refusal.h"
#include "stability/gains_matrices.h"

namespace swarmcert::stability {
namespace {

using tests::refuses;

constexpr char kHead[] = "schema = \"swarmcert/gains/1\"\n";

testing::AssertionResult refused(const std::string& body, const std::vector<std::string>& pieces) {
  return refuses([&] { parse_gains(kHead + body, "gains.toml"); }, pieces);
}

TEST(Gains, ReadsPidGainsLoopAndLags) {
  const Gains gains = parse_gains(std::string(kHead) + R"(
[position]
Kp = [20, 21, 10]
Kd = 5.5
Ki = [3, 3, 0]
integrator_limit = [0.1, 0.2, 0.3]
rate_hz = 100
integrator_step_s = 0.002
[attitude]
law = "robust"
[lag]
motor_s = 0.0575
attitude_s = 0.1
delay_s = 0.004
[network]
rate_hz = 50
latency_s = 0.01
)",
                                  "gains.toml");
  ASSERT_TRUE(gains.pid.has_value());
  EXPECT_FALSE(gains.composite.has_value());
  EXPECT_EQ(to_eigen(gains.pid->Kp_1_s2), Eigen::Vector3d(20, 21, 10));
  EXPECT_EQ(to_eigen(gains.pid->Kd_1_s), Eigen::Vector3d(5.5, 5.5, 5.5));
  EXPECT_EQ(to_eigen(gains.pid->Ki_1_s3), Eigen::Vector3d(3, 3, 0));
  EXPECT_EQ(gains.integrator_limit_m_s, (PerAxis{0.1, 0.2, 0.3}));
  EXPECT_EQ(gains.rate_hz, 100);
  EXPECT_EQ(gains.integrator_step_s, 0.002);
  EXPECT_EQ(gains.attitude_law, AttitudeLaw::kRobust);
  EXPECT_EQ(gains.motor_lag_s, 0.0575);
  EXPECT_EQ(gains.attitude_lag_s, 0.1);
  EXPECT_EQ(gains.delay_s, 0.004);
  EXPECT_EQ(gains.network_rate_hz, 50);
  EXPECT_EQ(gains.network_latency_s, 0.01);
}

// The firmware's own numbers for a vehicle of 27 g.
TEST(Gains, GainsOfTheMellingerControllerAreDividedByTheMassThatItIsTold) {
  const std::string body =
      "[position]\nkp_xy = 0.4\nkd_xy = 0.2\nki_xy = 0.05\ni_range_xy = 2\nkp_z = 1.25\nkd_z = 0.4\nki_z = "
      "0.05\n"
      "i_range_z = 0.4\n";
  const Gains gains = parse_gains(kHead + body + "mass = 0.027\nmassThrust = 132000\n", "g");
  ASSERT_TRUE(gains.pid.has_value());
  EXPECT_EQ(to_eigen(gains.pid->Kp_1_s2), Eigen::Vector3d(0.4 / 0.027, 0.4 / 0.027, 1.25 / 0.027));
  EXPECT_EQ(to_eigen(gains.pid->Kd_1_s), Eigen::Vector3d(0.2 / 0.027, 0.2 / 0.027, 0.4 / 0.027));
  EXPECT_EQ(to_eigen(gains.pid->Ki_1_s3), Eigen::Vector3d(0.05 / 0.027, 0.05 / 0.027, 0.05 / 0.027));
  EXPECT_EQ(gains.integrator_limit_m_s, (PerAxis{2, 2, 0.4}));
  EXPECT_TRUE(refused(body, {"mass", "ctrlMel.mass"}));
  EXPECT_TRUE(refused(body + "mass = 0.027\nKp = 3\n", {"Kp", "cannot be combined"}));
}

TEST(Gains, ReadsCompositeGainsAsMatrixDiagonalOrNumber) {
  const Gains gains = parse_gains(
      std::string(kHead) + "[position]\nLambda = [[4, 1, 0], [1, 4, 0], [0, 0, 2]]\nK = [0.1, 0.2, 0.3]\n",
      "g");
  ASSERT_TRUE(gains.composite.has_value());
  EXPECT_EQ(to_eigen(gains.composite->Lambda_1_s),
            (Eigen::Matrix3d() << 4, 1, 0, 1, 4, 0, 0, 0, 2).finished());
  EXPECT_EQ(to_eigen(gains.composite->K_kg_s), Eigen::Matrix3d(Eigen::Vector3d(0.1, 0.2, 0.3).asDiagonal()));
  const Gains isotropic = parse_gains(std::string(kHead) + "[position]\nLambda = 4\nK = 0.136\n", "g");
  EXPECT_EQ(to_eigen(isotropic.composite->Lambda_1_s), Eigen::Matrix3d(4 * Eigen::Matrix3d::Identity()));
}

TEST(Gains, WhatTheFileLeavesOutIsNoneOrWhatFirmwareWouldDo) {
  const Gains gains =
      parse_gains(std::string(kHead) + "[position]\nKp = 1\nKd = 1\nKi = 0\nrate_hz = 250\n", "g");
  EXPECT_EQ(gains.integrator_step_s, 1.0 / 250);
  EXPECT_TRUE(std::isinf(gains.integrator_limit_m_s[2]));
  EXPECT_EQ(gains.motor_lag_s, 0);
  EXPECT_EQ(gains.network_rate_hz, 0);
}

TEST(Gains, RefusalsNameLineKeyValueAndMend) {
  EXPECT_TRUE(
      refused("[position]\nKp = 1\nKd = 1\nKi = 1\nKii = 2\n", {"line 6", "position.Kii", "did you mean"}));
  EXPECT_TRUE(
      refused("[position]\nKp = [1, 2]\nKd = 1\nKi = 1\n", {"line 3", "position.Kp", "three numbers"}));
  EXPECT_TRUE(refused("[position]\nKp = -1\nKd = 1\nKi = 1\n", {"position.Kp", "-1", "negative"}));
  EXPECT_TRUE(refused("[position]\nKp = 1\nKd = 1\n", {"position.Ki", "missing"}));
  EXPECT_TRUE(refused("[position]\nKp = 1\nKd = 1\nKi = 1\nK = 1\n", {"position.K", "Lambda, K"}));
  EXPECT_TRUE(refused("[position]\nrate_hz = 100\n", {"position", "no gains"}));
  EXPECT_TRUE(refused("[position]\nLambda = [[1,0],[0,1]]\nK = 1\n", {"position.Lambda", "2 rows"}));
  EXPECT_TRUE(refused("[position]\nLambda = 1\nK = 1\nintegrator_step_s = 0.002\n", {"rate_hz"}));
  EXPECT_TRUE(refused("[position]\nLambda = 1\nK = 1\n[lag]\nmotor_s = -0.1\n", {"lag.motor_s", "-0.1"}));
  EXPECT_TRUE(refused("[position]\nLambda = 1\nK = 1\n[lag]\nmotor_s = 57.5\n",
                      {"line", "lag.motor_s = 57.5", "in seconds: 20 ms are 0.02"}));
  EXPECT_TRUE(
      refused("[position]\nLambda = 1\nK = 1\n[network]\nlatency_s = 4\n", {"network.latency_s = 4"}));
  EXPECT_TRUE(refused("[position]\nLambda = 1\nK = inf\n", {"position.K", "finite"}));
  EXPECT_TRUE(refuses([] { parse_gains("schema = \"swarmcert/model/1\"\n", "g"); }, {"schema", "gains/1"}));
}

TEST(Gains, RefusesSizesThatNoLoopHas) {
  const std::string pid = "[position]\nKp = 20\nKd = 10\nKi = 3\n";
  EXPECT_TRUE(
      refused("[position]\nKp = 1e308\nKd = 10\nKi = 3\n", {"line 3", "position.Kp = 1e+308", "1/s^2"}));
  EXPECT_TRUE(
      refused("[position]\nKp = 20\nKd = [10, 1e9, 10]\nKi = 3\n", {"position.Kd = 1e+09", "in 1/s"}));
  EXPECT_TRUE(refused("[position]\nKp = 20\nKd = 10\nKi = 1e200\n", {"position.Ki = 1e+200", "1/s^3"}));
  EXPECT_TRUE(refused("[position]\nLambda = 1e200\nK = 1\n", {"position.Lambda = 1e+200", "in 1/s"}));
  EXPECT_TRUE(
      refused("[position]\nLambda = [[4,0,0],[0,4,-1e99],[0,0,4]]\nK = 1\n", {"position.Lambda = -1e+99"}));
  EXPECT_TRUE(refused("[position]\nLambda = 4\nK = 1e300\n", {"position.K = 1e+300", "kg/s"}));
  EXPECT_TRUE(refused(pid + "integrator_limit = 1e300\n", {"position.integrator_limit = 1e+300", "m s"}));
  EXPECT_TRUE(refused(pid + "rate_hz = 1e9\n", {"position.rate_hz = 1e+09", "in hertz"}));
  EXPECT_TRUE(refused(pid + "rate_hz = 0.01\n",
                      {"position.rate_hz = 0.01", "a period was probably meant", "is 100"}));
  EXPECT_TRUE(refused(pid + "[network]\nrate_hz = 1e9\n", {"network.rate_hz = 1e+09"}));
}

}  // namespace
}  // namespace swarmcert::stability

#include <gtest/gtest.h>

#include <filesystem>

#include "data.h"
#include "stability/gains_matrices.h"

namespace swarmcert::controller {
namespace {

stability::Gains shipped(const std::string& name) {
  return stability::load_gains(swarmcert::tests::source_path("controller/gains/" + name));
}

TEST(ShippedGains, AllCanBeRead) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(swarmcert::tests::source_path("controller/gains"))) {
    if (entry.path().extension() != ".toml") continue;
    EXPECT_NO_THROW(stability::load_gains(entry.path().string())) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 5);
}

// The comments in the gains files name the sources of the expected values.
TEST(ShippedGains, SmallCrazyflieIsTheOneThatFlew) {
  const stability::Gains gains = shipped("crazyflie-small.toml");
  ASSERT_TRUE(gains.pid.has_value());
  EXPECT_EQ(stability::to_eigen(gains.pid->Kp_1_s2), Eigen::Vector3d(20, 20, 10));
  EXPECT_EQ(stability::to_eigen(gains.pid->Kd_1_s), Eigen::Vector3d(10, 10, 5));
  EXPECT_EQ(stability::to_eigen(gains.pid->Ki_1_s3), Eigen::Vector3d(3, 3, 10));
  EXPECT_EQ(gains.integrator_limit_m_s, (stability::PerAxis{0.1, 0.1, 0.1}));
  EXPECT_DOUBLE_EQ(gains.rate_hz * gains.integrator_step_s, 0.2) << "Ki acts five times weaker";
  const stability::Gains nominal = shipped("crazyflie-small-nominal.toml");
  EXPECT_DOUBLE_EQ(nominal.rate_hz * nominal.integrator_step_s, 1.0);
  EXPECT_EQ(stability::to_eigen(nominal.pid->Kp_1_s2), stability::to_eigen(gains.pid->Kp_1_s2));
}

}  // namespace
}  // namespace swarmcert::controller

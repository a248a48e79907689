#include "analysis/identification/balance/torque_balance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "data.h"
#include "stability/model.h"

namespace swarmcert::identification {
namespace {

using residuals::TorqueBlock;

stability::Model crazyflie() {
  return stability::read_model(tests::source_path("stability/models/crazyflie-small.toml"));
}

double lever_m() { return crazyflie().arm_m * std::sqrt(0.5); }

/// A minute of flight with a thrust that varies by 8 % and a torque that is `law` times this function of the thrust.
template <typename Law>
TorqueBalance balance_of(const Law& law) {
  constexpr double kScatter_Nm = 2e-5;
  std::mt19937 generator(6);
  std::normal_distribution<double> normal;
  std::vector<TorqueBlock> blocks;
  for (int i = 0; i < 60; ++i) {
    TorqueBlock block;
    block.thrust_N = crazyflie().weight_N() * (1 + 0.08 * normal(generator));
    const Eigen::Vector2d torque_Nm = law(block.thrust_N / crazyflie().weight_N());
    block.torque_B_Nm = {torque_Nm.x() + kScatter_Nm * normal(generator),
                         torque_Nm.y() + kScatter_Nm * normal(generator), 0};
    blocks.push_back(block);
  }
  TorqueBalance balance;
  fit_torques(blocks, crazyflie(), balance);
  return balance;
}

const Eigen::Vector2d kTorque_Nm(4e-4, -3e-4);

TEST(TorqueBalance, AConstantTorqueIsNamedBelowTheOffsetOfABattery) {
  const TorqueBalance balance = balance_of([](double) { return kTorque_Nm; });
  ASSERT_LT(kTorque_Nm.norm() / crazyflie().weight_N(), balance.least_offset_m);
  EXPECT_EQ(balance.effect, "torque_bias");
  EXPECT_TRUE(balance.rivals.empty());
  for (int axis = 0; axis < 2; ++axis)
    EXPECT_NEAR(balance.torque_Nm[axis], kTorque_Nm[axis], 2 * balance.torque_half_Nm[axis]);
}

TEST(TorqueBalance, OrdinaryBatteriesAndRotorsAreNotNamed) {
  const double weight_N = crazyflie().weight_N();
  EXPECT_EQ(balance_of([](double thrust) { return Eigen::Vector2d(thrust * kTorque_Nm); }).effect, "")
      << "a battery";
  const double spread_Nm = kRotorSpread * lever_m() * weight_N;
  const auto as_the_root = [&](double thrust) { return Eigen::Vector2d(spread_Nm * std::sqrt(thrust), 0); };
  EXPECT_EQ(balance_of(as_the_root).effect, "") << "rotors that differ by a constant duty";
  const auto half_of_it = [&](double) { return Eigen::Vector2d(0.45 * spread_Nm, 0); };
  EXPECT_EQ(balance_of(half_of_it).effect, "") << "their constant part";
  EXPECT_EQ(balance_of([](double) { return Eigen::Vector2d(0, 0); }).effect, "");
}

TEST(TorqueBalance, AnOffsetOfFourMillimetresIsACentreOfMass) {
  const double weight_N = crazyflie().weight_N();
  const TorqueBalance balance =
      balance_of([&](double thrust) { return Eigen::Vector2d(0, 0.004 * thrust * weight_N); });
  EXPECT_EQ(balance.effect, "com_offset");
  EXPECT_EQ(std::count(balance.rivals.begin(), balance.rivals.end(), "torque_bias"), 0);
  EXPECT_NEAR(balance.offset_m.x(), 0.004, 1e-4);
}

TEST(TorqueBalance, AnOffsetBeyondTheRotorsIsNeitherNamedNorPrinted) {
  const double torque_Nm = 1.2 * crazyflie().arm_m * crazyflie().weight_N();
  const TorqueBalance balance =
      balance_of([&](double thrust) { return Eigen::Vector2d(0, torque_Nm * thrust); });
  EXPECT_EQ(balance.effect, "");
  EXPECT_GT(balance.offset_m.norm(), crazyflie().arm_m);
  EXPECT_FALSE(balance.has_offset());
  EXPECT_EQ(in_words(balance).find(" mm"), std::string::npos) << in_words(balance);
}

}  // namespace
}  // namespace swarmcert::identification

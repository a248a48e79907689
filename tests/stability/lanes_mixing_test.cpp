#include "stability/simulation/lanes_mixing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "controller/rotors_on_circle.h"
#include "stability/bodies/lanes.h"

namespace swarmcert::stability {
namespace {

SWARMCERT_FOR_LANES controller::Mixed<Lanes> mixed(const controller::Allocation<Lanes>& allocation,
                                                   const controller::ForceLimits<Lanes>& limits,
                                                   const controller::Wrench<Lanes>& wanted) {
  return mix(allocation, limits, wanted);
}

TEST(LanesMixing, GivesEachVehicleTheBitsOfItsOwnMixing) {
  if (!lanes_are_fast()) GTEST_SKIP() << "this processor does not execute them";
  std::mt19937_64 random(31);
  const auto uniform = [&random](double from, double to) {
    return static_cast<float>(std::uniform_real_distribution<double>(from, to)(random));
  };
  const controller::ForceLimits<float> limits{0.005F, 0.15F};
  int without_limits = 0, with_limits = 0;
  for (const int rotors : {3, 4, 6}) {
    const auto alone = controller::allocation(controller::rotors_on_circle(rotors, 0.05F, 0.7F, 0.006F));
    controller::Allocation<Lanes> together;
    together.rank = alone.rank;
    together.count = alone.count;
    for (int i = 0; i < rotors; ++i) {
      for (int c = 0; c < 4; ++c) together.inverse[i][c] = Lanes(alone.inverse[i][c]);
    }
    for (int trial = 0; trial < 3000; ++trial) {
      const double torque_N_m = trial % 3 == 0 ? 2e-4 : trial % 3 == 1 ? 2e-3 : 6e-3;
      controller::Wrench<float> wanted[Lanes::kCount];
      controller::Wrench<Lanes> all;
      for (int lane = 0; lane < Lanes::kCount; ++lane) {
        const float t = static_cast<float>(torque_N_m);
        wanted[lane] = {uniform(0.1, 0.1 * rotors), {uniform(-t, t), uniform(-t, t), uniform(-t, t)}};
        all.thrust_N.set(lane, wanted[lane].thrust_N);
        all.torque_N_m.x.set(lane, wanted[lane].torque_N_m.x);
        all.torque_N_m.y.set(lane, wanted[lane].torque_N_m.y);
        all.torque_N_m.z.set(lane, wanted[lane].torque_N_m.z);
      }
      Lanes::split = 0;
      const controller::Mixed<Lanes> given =
          mixed(together, {Lanes(limits.lower_N), Lanes(limits.upper_N)}, all);
      if (Lanes::split != 0) continue;  // the result is invalid
      bool limited = false;
      for (int lane = 0; lane < Lanes::kCount; ++lane) {
        const controller::Mixed<float> own = controller::mix(alone, limits, wanted[lane]);
        ASSERT_EQ(given.valid, own.valid);
        ASSERT_EQ(given.thrust_limited, own.thrust_limited);
        ASSERT_EQ(given.thrust_N[lane], own.thrust_N);
        ASSERT_EQ(given.roll_pitch_share[lane], own.roll_pitch_share);
        ASSERT_EQ(given.yaw_share[lane], own.yaw_share);
        for (int i = 0; i < controller::kMostRotors; ++i) {
          ASSERT_EQ(given.forces.at_N[i][lane], own.forces.at_N[i]) << rotors << " rotors, number " << i;
        }
        limited = limited || own.thrust_limited || own.yaw_share < 1;
      }
      ++(limited ? with_limits : without_limits);
    }
  }
  EXPECT_GT(without_limits, 1000);
  EXPECT_GT(with_limits, 10);
}

TEST(LanesMixing, RefusesWhatMixingRefuses) {
  if (!lanes_are_fast()) GTEST_SKIP() << "this processor does not execute them";
  const auto alone = controller::allocation(controller::crazyflie_rotors(Lanes(0.05F), Lanes(0.006F)));
  const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
  const auto valid = [&](float lower_N, float upper_N, float thrust_N, float yaw_N_m) {
    Lanes::split = 0;
    return mixed(alone, {Lanes(lower_N), Lanes(upper_N)},
                 {Lanes(thrust_N), {Lanes(0), Lanes(0), Lanes(yaw_N_m)}})
        .valid;
  };
  EXPECT_TRUE(valid(0.005F, 0.15F, 0.3F, 1e-4F));
  EXPECT_FALSE(valid(0.005F, infinite, 0.3F, 1e-4F));
  EXPECT_FALSE(valid(-infinite, 0.15F, 0.3F, 1e-4F));
  EXPECT_FALSE(valid(0.15F, 0.005F, 0.3F, 1e-4F));
  EXPECT_FALSE(valid(0.005F, 0.15F, nan, 1e-4F));
  EXPECT_FALSE(valid(0.005F, 0.15F, 0.3F, nan));
  EXPECT_FALSE(valid(0.005F, 0.15F, infinite, 1e-4F));
}

}  // namespace
}  // namespace swarmcert::stability

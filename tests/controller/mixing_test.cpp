#include "controller/mixing.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "random_vectors.h"
#include "rotors_on_circle.h"

namespace swarmcert::controller {
namespace {

constexpr double kArm_m = 0.046, kTorquePerThrust_m = 0.006;

std::vector<Rotors<double>> all_vehicles() {
  std::vector<Rotors<double>> all = {crazyflie_rotors(kArm_m, kTorquePerThrust_m)};
  for (const int count : {3, 4, 6, 8})
    all.push_back(rotors_on_circle(count, kArm_m, 0.3, kTorquePerThrust_m));
  return all;
}

template <typename To>
Rotors<To> cast(const Rotors<double>& rotors) {
  Rotors<To> result;
  result.count = rotors.count;
  for (int i = 0; i < rotors.count; ++i) {
    const Rotor<double>& r = rotors.at[i];
    result.at[i] = {static_cast<To>(r.x_m), static_cast<To>(r.y_m), static_cast<To>(r.torque_per_thrust_m)};
  }
  return result;
}

TEST(Allocation, IsARightInverseOnTheControlledRows) {
  for (const Rotors<double>& rotors : all_vehicles()) {
    const Allocation<double> a = allocation(rotors);
    ASSERT_EQ(a.rank, rotors.count == 3 ? 3 : 4);
    for (int row = 0; row < a.rank; ++row) {
      for (int column = 0; column < 4; ++column) {
        double sum = 0;
        for (int i = 0; i < rotors.count; ++i) sum += actuation(rotors.at[i], row) * a.inverse[i][column];
        EXPECT_NEAR(sum, row == column ? 1.0 : 0.0, 1e-12) << rotors.count << " rotors";
      }
    }
  }
}

// Given the right inverse above, the only remaining Moore-Penrose condition is the symmetry of B^+ B.
TEST(Allocation, IsTheMoorePenroseInverse) {
  for (const Rotors<double>& rotors : all_vehicles()) {
    const Allocation<double> a = allocation(rotors);
    for (int i = 0; i < rotors.count; ++i) {
      for (int j = 0; j < rotors.count; ++j) {
        double ij = 0, ji = 0;
        for (int row = 0; row < a.rank; ++row) {
          ij += a.inverse[i][row] * actuation(rotors.at[j], row);
          ji += a.inverse[j][row] * actuation(rotors.at[i], row);
        }
        EXPECT_NEAR(ij, ji, 1e-12);
      }
    }
  }
}

// The firmware's own mixer for this frame:
// m1 = t - r - p - y, m2 = t - r + p + y, m3 = t + r + p - y, m4 = t + r - p + y.
TEST(Allocation, OfACrazyflieIsItsMixer) {
  const Allocation<double> a = allocation(crazyflie_rotors(kArm_m, kTorquePerThrust_m));
  const double rp = 0.25 / (kArm_m / std::sqrt(2.0)), y = 0.25 / kTorquePerThrust_m;
  const double expected[4][4] = {
      {0.25, -rp, -rp, -y}, {0.25, -rp, rp, y}, {0.25, rp, rp, -y}, {0.25, rp, -rp, y}};
  for (int i = 0; i < 4; ++i) {
    for (int row = 0; row < 4; ++row) EXPECT_NEAR(a.inverse[i][row], expected[i][row], 1e-10);
  }
}

TEST(Allocation, ReportsTheRankOfDegenerateVehicles) {
  Rotors<float> line;
  line.count = 4;
  for (int i = 0; i < 4; ++i)
    line.at[i] = {0.05f * static_cast<float>(i), 0.0f, i % 2 == 0 ? 0.006f : -0.006f};
  EXPECT_EQ(allocation(line).rank, 0) << "no roll";

  Rotors<float> no_reaction = rotors_on_circle(4, 0.046f, 0.3f, 0.0f);
  EXPECT_EQ(allocation(no_reaction).rank, 3);
  Rotors<float> one_way = rotors_on_circle(4, 0.046f, 0.3f, 0.006f);
  for (Rotor<float>& rotor : one_way.at) rotor.torque_per_thrust_m = 0.006f;
  EXPECT_EQ(allocation(one_way).rank, 3) << "yaw torque is proportional to thrust";

  EXPECT_EQ(allocation(rotors_on_circle(2, 0.046f, 0.0f, 0.006f)).rank, 0);
  EXPECT_EQ(allocation(rotors_on_circle(9, 0.046f, 0.0f, 0.006f)).rank, 0);
  Rotors<float> broken = crazyflie_rotors(0.046f, 0.006f);
  broken.at[2].x_m = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(allocation(broken).rank, 0);
}

class Mixing : public testing::Test {
 protected:
  static constexpr float kLargest_N = 0.15f;
  static constexpr ForceLimits<float> kLimits{0.0f, kLargest_N};
  std::mt19937 generator_{12};

  Wrench<float> random_wrench(const Rotors<float>& rotors, double excess) {
    const auto n = static_cast<float>(rotors.count);
    return {static_cast<float>(tests::uniform(generator_, -0.1, 1.1)) * n * kLargest_N,
            {static_cast<float>(tests::uniform(generator_, -excess, excess)) * 0.046f * kLargest_N,
             static_cast<float>(tests::uniform(generator_, -excess, excess)) * 0.046f * kLargest_N,
             static_cast<float>(tests::uniform(generator_, -excess, excess)) * 0.006f * kLargest_N}};
  }
};

TEST_F(Mixing, FeasibleWrenchesAreGivenExactly) {
  // Feasible: the minimum-norm forces that produce the wrench are within the limits. If roll or pitch alone exceed
  // them, the desired yaw torque may still make the wrench feasible.
  int kept = 0, needs_yaw = 0;
  for (const Rotors<double>& vehicle : all_vehicles()) {
    const Rotors<float> rotors = cast<float>(vehicle);
    const Allocation<float> a = allocation(rotors);
    for (int i = 0; i < 4000; ++i) {
      RotorForces<float> some;
      for (int k = 0; k < rotors.count; ++k) {
        some.at_N[k] = static_cast<float>(tests::uniform(generator_, 0, 1)) * kLargest_N;
      }
      Wrench<float> wanted = wrench(rotors, some);
      if (a.rank == 3) wanted.torque_N_m.z = 0;
      const float eta[] = {wanted.thrust_N, wanted.torque_N_m.x, wanted.torque_N_m.y, wanted.torque_N_m.z};
      bool is_feasible = true;
      for (int k = 0; k < rotors.count; ++k) {
        float least = 0;
        for (int row = 0; row < 4; ++row) least += a.inverse[k][row] * eta[row];
        is_feasible = is_feasible && least > 1e-5f && least < kLargest_N - 1e-5f;
      }
      if (!is_feasible) continue;
      ++kept;
      Wrench<float> without_yaw = wanted;
      without_yaw.torque_N_m.z = 0;
      needs_yaw += mix(a, kLimits, without_yaw).roll_pitch_share < 1;
      const Mixed<float> mixed = mix(a, kLimits, wanted);
      ASSERT_TRUE(mixed.valid);
      ASSERT_FALSE(mixed.thrust_limited);
      ASSERT_EQ(mixed.roll_pitch_share, 1) << rotors.count << " rotors";
      ASSERT_EQ(mixed.yaw_share, 1) << rotors.count << " rotors";
      const Wrench<float> given = wrench(rotors, mixed.forces);
      EXPECT_NEAR(given.thrust_N, wanted.thrust_N, 1e-6);
      EXPECT_NEAR(given.torque_N_m.x, wanted.torque_N_m.x, 1e-7);
      EXPECT_NEAR(given.torque_N_m.y, wanted.torque_N_m.y, 1e-7);
      if (a.rank == 4) {
        EXPECT_NEAR(given.torque_N_m.z, wanted.torque_N_m.z, 1e-7);
      }
    }
  }
  EXPECT_GT(kept, 3000);
  EXPECT_GT(needs_yaw, 300);
}

TEST_F(Mixing, ForcesFollowTheWrenchWithoutJumps) {
  // From feasible wrenches outwards through every limit, a step of 1e-4 of the torques changes no force by over 1e-2.
  for (const Rotors<double>& rotors : all_vehicles()) {
    const Allocation<double> a = allocation(rotors);
    const ForceLimits<double> limits{0, 0.15};
    int limited = 0;
    for (int i = 0; i < 20; ++i) {
      const auto at = [&, x = tests::uniform(generator_, -1, 1), y = tests::uniform(generator_, -1, 1),
                       z = tests::uniform(generator_, -1, 1)](double size) {
        return mix(a, limits,
                   {0.3 * rotors.count * 0.15, {size * 0.02 * x, size * 0.02 * y, size * 0.003 * z}});
      };
      Mixed<double> last = at(0);
      for (double size = 0; size < 2; size += 1e-4) {
        const Mixed<double> mixed = at(size);
        limited += mixed.roll_pitch_share < 1;
        for (int k = 0; k < rotors.count; ++k) {
          ASSERT_LT(std::abs(mixed.forces.at_N[k] - last.forces.at_N[k]), 0.01 * 0.15) << size;
        }
        last = mixed;
      }
    }
    EXPECT_GT(limited, 1000);
  }
}

TEST_F(Mixing, ForcesStayWithinTheLimitsWhateverIsAsked) {
  for (const Rotors<double>& vehicle : all_vehicles()) {
    const Rotors<float> rotors = cast<float>(vehicle);
    const Allocation<float> a = allocation(rotors);
    for (int i = 0; i < 5000; ++i) {
      Wrench<float> wanted = random_wrench(rotors, 20);
      if (i % 50 == 0) wanted.torque_N_m.x = 1e37f;
      if (i % 50 == 1) wanted.thrust_N = -3e38f;
      const Mixed<float> mixed = mix(a, kLimits, wanted);
      for (int k = 0; k < rotors.count; ++k) {
        ASSERT_GE(mixed.forces.at_N[k], 0.0f);
        ASSERT_LE(mixed.forces.at_N[k], kLargest_N);
      }
    }
  }
}

// Thrust is kept whenever all rotors together can produce it, roll and pitch are reduced only after yaw is zero, and
// nothing is reduced more than necessary.
TEST_F(Mixing, GivesUpYawBeforeRollAndPitchBeforeThrust) {
  int lost_yaw = 0, lost_roll = 0, lost_thrust = 0;
  for (const Rotors<double>& vehicle : all_vehicles()) {
    const Rotors<float> rotors = cast<float>(vehicle);
    const Allocation<float> a = allocation(rotors);
    const float most = static_cast<float>(rotors.count) * kLargest_N;
    for (int i = 0; i < 4000; ++i) {
      const Wrench<float> wanted = random_wrench(rotors, 8);
      const Mixed<float> mixed = mix(a, kLimits, wanted);
      const Wrench<float> given = wrench(rotors, mixed.forces);
      const float feasible = clamp(wanted.thrust_N, 0.0f, most);
      EXPECT_NEAR(given.thrust_N, feasible, 2e-6);
      EXPECT_EQ(mixed.thrust_limited, mixed.thrust_N != wanted.thrust_N);
      lost_thrust += mixed.thrust_limited;
      EXPECT_NEAR(given.torque_N_m.x, mixed.roll_pitch_share * wanted.torque_N_m.x, 2e-7);
      EXPECT_NEAR(given.torque_N_m.y, mixed.roll_pitch_share * wanted.torque_N_m.y, 2e-7);
      lost_roll += mixed.roll_pitch_share < 1.0f;
      if (mixed.roll_pitch_share > 0.01f && mixed.roll_pitch_share < 0.98f) {
        // No larger share of roll and pitch is feasible with any share of yaw.
        for (int share = 0; share <= 10; ++share) {
          Wrench<float> more = wanted;
          more.torque_N_m = scaled(1.01f * mixed.roll_pitch_share, wanted.torque_N_m);
          more.torque_N_m.z = 0.1f * static_cast<float>(share) * wanted.torque_N_m.z;
          EXPECT_LT(mix(a, kLimits, more).roll_pitch_share, 1.0f) << share;
        }
      }
      if (mixed.yaw_share < 1.0f) ++lost_yaw;
      if (a.rank == 4) {
        EXPECT_NEAR(given.torque_N_m.z, mixed.yaw_share * wanted.torque_N_m.z, 5e-8);
      }
      // The yaw torque does not reduce the others.
      Wrench<float> without_yaw = wanted;
      without_yaw.torque_N_m.z = 0;
      EXPECT_LE(mix(a, kLimits, without_yaw).roll_pitch_share, mixed.roll_pitch_share);
    }
  }
  EXPECT_GT(lost_yaw, 1000);
  EXPECT_GT(lost_roll, 1000);
  EXPECT_GT(lost_thrust, 500);
}

TEST_F(Mixing, InvalidInputGivesTheLowerLimitAndSaysSo) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinite = std::numeric_limits<float>::infinity();
  const Allocation<float> a = allocation(crazyflie_rotors(0.046f, 0.006f));
  const ForceLimits<float> limits{0.01f, kLargest_N};
  for (const Wrench<float>& wanted : {Wrench<float>{nan, {}},
                                      {0.3f, {nan, 0, 0}},
                                      {0.3f, {0, 0, infinite}},
                                      {infinite, {}},
                                      {0.3f, {3e38f, 0, 0}}}) {
    const Mixed<float> mixed = mix(a, limits, wanted);
    EXPECT_FALSE(mixed.valid);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(mixed.forces.at_N[i], 0.01f);
  }
  for (const ForceLimits<float>& bad :
       {ForceLimits<float>{0.2f, 0.1f}, {nan, 0.1f}, {0.0f, nan}, {0.0f, infinite}}) {
    const Mixed<float> mixed = mix(a, bad, {0.3f, {}});
    EXPECT_FALSE(mixed.valid);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(mixed.forces.at_N[i], 0.0f);
  }
  EXPECT_FALSE(mix(Allocation<float>{}, limits, {0.3f, {}}).valid);
}

}  // namespace
}  // namespace swarmcert::controller

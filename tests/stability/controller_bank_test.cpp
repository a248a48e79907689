#include "stability/simulation/controller_bank.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "nn/base/random.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

constexpr double kBankPeriod_s = 0.001;
constexpr int kVehicles = 5;  ///< enough to share SIMD lanes

Gains bank_gains() {
  return parse_gains(
      "schema = \"swarmcert/gains/1\"\n[position]\nKp = [20, 20, 10]\nKd = [10, 10, 5]\nKi = [3, 3, 10]\n"
      "[attitude]\nlaw = \"lee\"\n",
      "gains.toml");
}

Eigen::Vector3d random_vector(files::Random& random, double size) {
  return size * Eigen::Vector3d(random.symmetric(), random.symmetric(), random.symmetric());
}

/// Inputs of one vehicle in one period. Every tenth setpoint is far away, so that thrust reaches its limit.
struct Told {
  Eigen::Vector3d p_W_m, v_W_m_s, omega_B_rad_s;
  Eigen::Quaterniond attitude;
  Setpoint to;
};

Told random_told(files::Random& random) {
  Told told;
  told.p_W_m = random_vector(random, 1);
  told.v_W_m_s = random_vector(random, 1);
  told.omega_B_rad_s = random_vector(random, 2);
  const Eigen::Vector3d tilt = random_vector(random, 0.3);
  told.attitude = Eigen::Quaterniond(1, tilt.x(), tilt.y(), tilt.z()).normalized();
  told.to.p_W_m = random_vector(random, random.below(10) == 0 ? 50 : 1);
  told.to.v_W_m_s = random_vector(random, 1);
  told.to.a_W_m_s2 = random_vector(random, 1);
  return told;
}

void tell(const Told& told, int vehicle, std::uint32_t now_ms, ControllerBank& bank, Rows& rows) {
  bank.see(vehicle, told.p_W_m, told.v_W_m_s, now_ms);
  bank.follow(vehicle, told.to);
  double* const x = rows.data() + row_index(vehicle, kVehicleStateSize);
  for (int c = 0; c < 4; ++c) x[(kQuaternion + c) * kRowLength] = told.attitude.coeffs()[c];
  for (int c = 0; c < 3; ++c) x[(kOmega + c) * kRowLength] = told.omega_B_rad_s[c];
}

TEST(ControllerBank, AVehicleAmongOthersIsGivenTheCommandsThatItHasAlone) {
  const Swarm swarm(tests::small_vehicle(), kVehicles), one(tests::small_vehicle(), 1);
  const auto together = make_float_bank(swarm, bank_gains(), kBankPeriod_s);
  std::vector<std::unique_ptr<ControllerBank>> alone;
  for (int i = 0; i < kVehicles; ++i) alone.push_back(make_float_bank(one, bank_gains(), kBankPeriod_s));
  Rows rows(lines_for(kVehicles) * kVehicleStateSize), own(kVehicleStateSize);
  std::vector<ControlRecord> records(kVehicles), record(1);
  files::Random random(1);
  int saturated = 0;
  for (std::uint32_t now_ms = 1; now_ms <= 500; ++now_ms) {
    std::vector<Told> told;
    for (int i = 0; i < kVehicles; ++i) told.push_back(random_told(random));
    for (int i = 0; i < kVehicles; ++i) tell(told[static_cast<std::size_t>(i)], i, now_ms, *together, rows);
    const bool position_is_due = now_ms % 2 == 0;
    together->step(rows.data(), 4.0, now_ms, position_is_due, records);
    for (int i = 0; i < kVehicles; ++i) {
      ControllerBank& bank = *alone[static_cast<std::size_t>(i)];
      tell(told[static_cast<std::size_t>(i)], 0, now_ms, bank, own);
      bank.step(own.data(), 4.0, now_ms, position_is_due, record);
      const ControlRecord& shared = records[static_cast<std::size_t>(i)];
      ASSERT_EQ(shared.rotor_N, record[0].rotor_N) << "vehicle " << i << ", " << now_ms << " ms";
      ASSERT_EQ(shared.saturated, record[0].saturated);
      ASSERT_EQ(shared.faults, record[0].faults);
      saturated += shared.saturated ? 1 : 0;
    }
  }
  EXPECT_GT(saturated, 20) << "some commands must be at their limit";
  EXPECT_LT(saturated, 400 * kVehicles);
}

TEST(ControllerBank, FloatAnswersAsDoubleUpToRounding) {
  const Swarm one(tests::small_vehicle(), 1);
  const auto in_float = make_float_bank(one, bank_gains(), kBankPeriod_s);
  const auto in_double = make_double_bank(one, bank_gains(), kBankPeriod_s);
  Rows rows(kVehicleStateSize);
  std::vector<ControlRecord> a(1), b(1);
  files::Random random(2);
  for (std::uint32_t now_ms = 1; now_ms <= 200; ++now_ms) {
    Told told = random_told(random);
    told.to.p_W_m = told.p_W_m + random_vector(random, 0.1);
    tell(told, 0, now_ms, *in_float, rows);
    tell(told, 0, now_ms, *in_double, rows);
    in_float->step(rows.data(), 4.0, now_ms, true, a);
    in_double->step(rows.data(), 4.0, now_ms, true, b);
    if (a[0].saturated || b[0].saturated) continue;  // the decision at a limit is discontinuous
    for (std::size_t r = 0; r < kNumRotors; ++r)
      ASSERT_NEAR(a[0].rotor_N[r], b[0].rotor_N[r], 1e-4) << now_ms;
  }
}

}  // namespace
}  // namespace swarmcert::stability

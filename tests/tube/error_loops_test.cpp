// Kernels of the position loops against the equations as they are written down.
#include "analysis/tracking/tube/error_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::analysis {
namespace {

/// m e'' = T, tau T' = -m (Kp e + Kd e' + Ki int e) - T, from T(0) = 1 N and e = 0, by Runge-Kutta.
struct Start {
  static constexpr double kMass_kg = 0.034, kKp = 10, kKd = 5, kKi = 10, kTau_s = 0.0575;
  double x[4] = {0, 0, 0, 1};  ///< e, e', int e, T

  void step(double dt) {
    double k[4][4], at[4];
    const double share[] = {0, 0.5, 0.5, 1};
    for (int stage = 0; stage < 4; ++stage) {
      for (int i = 0; i < 4; ++i) at[i] = x[i] + (stage > 0 ? share[stage] * dt * k[stage - 1][i] : 0);
      k[stage][0] = at[1];
      k[stage][1] = at[3] / kMass_kg;
      k[stage][2] = at[0];
      k[stage][3] = (-kMass_kg * (kKp * at[0] + kKd * at[1] + kKi * at[2]) - at[3]) / kTau_s;
    }
    for (int i = 0; i < 4; ++i) x[i] += dt / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
  }
};

TEST(ErrorLoops, RotorsThatStartWithAnExcessOfThrustAreEnclosedSliceBySlice) {
  stability::TrackingSetup tracking;
  tracking.plant.mass_kg = Start::kMass_kg;
  tracking.gains.pid = stability::PidGains{{Start::kKp, Start::kKp, Start::kKp},
                                           {Start::kKd, Start::kKd, Start::kKd},
                                           {Start::kKi, Start::kKi, Start::kKi}};
  tracking.gains.motor_lag_s = Start::kTau_s;
  constexpr double kSlice_s = 0.02;
  constexpr int kSlices = 150, kSteps = 40;
  const ErrorLoops loops = error_loops(tracking, kSlice_s, kSlices);
  ASSERT_EQ(loops.refusal, "");
  const LagStart start = lag_start(loops.axis[2], kSlice_s);
  ASSERT_EQ(start.position_m.size(), static_cast<std::size_t>(kSlices));
  Start flown;
  double largest_m = 0, widest_m = 0;
  for (std::size_t n = 0; n < kSlices; ++n) {
    for (int i = 0; i <= kSteps; ++i) {
      ASSERT_GE(flown.x[0], start.position_m[n].lo - 1e-12) << n;
      ASSERT_LE(flown.x[0], start.position_m[n].hi + 1e-12) << n;
      ASSERT_GE(flown.x[1], start.velocity_m_s[n].lo - 1e-12) << n;
      ASSERT_LE(flown.x[1], start.velocity_m_s[n].hi + 1e-12) << n;
      if (i < kSteps) flown.step(kSlice_s / kSteps);
      largest_m = std::max(largest_m, std::abs(flown.x[0]));
    }
    widest_m = std::max(widest_m, start.position_m[n].mag());
  }
  EXPECT_GT(largest_m, 0.1) << "a newton must move the vehicle";
  EXPECT_LT(widest_m, 1.2 * largest_m);
}

TEST(ErrorLoops, WithoutALagTheThrustFollowsAtOnce) {
  EXPECT_TRUE(lag_start(ErrorLoop{}, 0.02).position_m.empty());
}

}  // namespace
}  // namespace swarmcert::analysis

// Kernels of the position loops compared with the differential equations.
#include "analysis/tracking/tube/error_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

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
  stability::FlownLoop tracking;
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
      ASSERT_GE(flown.x[0], start.position_m[n].lower - 1e-12) << n;
      ASSERT_LE(flown.x[0], start.position_m[n].upper + 1e-12) << n;
      ASSERT_GE(flown.x[1], start.velocity_m_s[n].lower - 1e-12) << n;
      ASSERT_LE(flown.x[1], start.velocity_m_s[n].upper + 1e-12) << n;
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

/// A loop with `lag_s` that is sampled at 100 Hz, with cells of `slice_s`.
ErrorLoop sampled_loop(double lag_s, double slice_s, int slices) {
  stability::FlownLoop tracking;
  tracking.plant.mass_kg = Start::kMass_kg;
  tracking.gains.pid = stability::PidGains{{Start::kKp, Start::kKp, Start::kKp},
                                           {Start::kKd, Start::kKd, Start::kKd},
                                           {Start::kKi, Start::kKi, Start::kKi}};
  tracking.gains.motor_lag_s = lag_s;
  tracking.gains.rate_hz = 100;
  tracking.gains.integrator_step_s = 0.01;
  return error_loops(tracking, slice_s, slices, true).axis[2];
}

TEST(ErrorLoops, RampsBetweenSamplesActAsTheirMeanAndASawtoothThatItsKernelsBound) {
  constexpr double kPeriod_s = 0.01;
  constexpr int kPeriods = 300;
  for (const double lag_s : {0.0, 0.0575}) {
    SCOPED_TRACE(lag_s);
    const ErrorLoop loop = sampled_loop(lag_s, kPeriod_s, kPeriods);
    ASSERT_TRUE(loop.has_whole_periods);
    EXPECT_EQ(loop.slope3.has_value(), lag_s > 0);
    EXPECT_FALSE(sampled_loop(lag_s, 0.0125, 4).has_whole_periods);
    // m e'' = F - the lagged held command, where F = (t - t_k)/T s_k N and s_k is the sign that maximises the final
    // displacement: taken from the kernel's value in a first pass, then simulated.
    const auto answer = [&](const std::vector<double>& signs) {
      double x[4] = {0, 0, 0, 0};  // e, e', int e, thrust of the law
      constexpr int kSteps = 40;
      const double dt = kPeriod_s / kSteps;
      std::vector<double> ends;
      for (const double sign : signs) {
        for (int i = 0; i < kSteps; ++i) {
          const auto rate = [&](const double* at, double share, double* result) {
            const double command =
                sign * (i + share) / kSteps -
                Start::kMass_kg * (Start::kKp * at[0] + Start::kKd * at[1] + Start::kKi * at[2]);
            result[0] = at[1];
            result[1] = (lag_s > 0 ? at[3] : command) / Start::kMass_kg;
            result[2] = at[0];
            result[3] = lag_s > 0 ? (command - at[3]) / lag_s : 0;
          };
          double first[4], middle[4], second[4];
          rate(x, 0, first);
          for (int c = 0; c < 4; ++c) middle[c] = x[c] + dt / 2 * first[c];
          rate(middle, 0.5, second);
          for (int c = 0; c < 4; ++c) x[c] += dt * second[c];
        }
        ends.push_back(x[0]);
      }
      return ends;
    };
    std::vector<double> one(kPeriods, 0.0);
    one[0] = 1;
    const std::vector<double> kernel = answer(one);  // e at the ends of all periods after one ramp
    std::vector<double> worst(kPeriods);
    for (std::size_t k = 0; k < kPeriods; ++k) worst[k] = kernel[kPeriods - 1 - k] >= 0 ? 1 : -1;
    const double reached_m = answer(worst).back();
    double bound_m = 0, whole_m = 0;
    for (std::size_t n = 0; n < kPeriods; ++n) {
      bound_m += loop.h1->integral[n] / 2 + kPeriod_s / 8 * loop.slope1->integral[n];
      whole_m += loop.h1->integral[n];
    }
    EXPECT_LE(reached_m, bound_m);
    EXPECT_GT(reached_m, 0.9 * bound_m);
    EXPECT_LT(bound_m, 0.6 * whole_m) << "what a bound by the largest force would give";
  }
}

}  // namespace
}  // namespace swarmcert::analysis

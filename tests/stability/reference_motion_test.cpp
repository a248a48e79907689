// A moving setpoint: no simulated error exceeds its part of the bound, and the worst ones come close to it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "stability/bounds/error_parts.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/model.h"
#include "stability/vehicle.h"
#include "stepped_loop.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

constexpr double kFine_s = 0.0025;

struct FollowingLoop {
  AxisLoop loop;
  int steps;  ///< number of kFine_s per period; 0: continuous

  SampledLoop sampled() const { return {loop, steps * kFine_s, steps * kFine_s}; }
  SteppedLoop stepped() const {
    return steps == 0 ? SteppedLoop(loop, kFine_s) : SteppedLoop(sampled(), steps);
  }
  double part_m(const ReferenceMotion& reference) const {
    OtherErrors other;
    other.reference = reference;
    return steps == 0 ? error_parts(loop, 0, other).reference_m
                      : error_parts(sampled(), 0, other).reference_m;
  }
};

std::vector<FollowingLoop> following_loops() {
  return {{{kMass_kg, 10, 5, 10, {1 / 17.4}, 0}, 0},
          {{kMass_kg, 20, 10, 3, {1 / 17.4, 0.05}, 0}, 0},
          {{kMass_kg, 30, 9, 0, {0.03}, 0}, 0},
          {{kMass_kg, 10, 5, 10, {1 / 17.4}, 0.015}, 4},
          {{kMass_kg, 30, 9, 0, {0.03}, 0.005}, 4},
          {{kMass_kg, 10, 5, 1, {1 / 17.4}, 0}, 8},
          {{kMass_kg, 20, 10, 12, {1 / 17.4, 0.03}, 0}, 1}};
}

/// Returns e at the end of every step if the setpoint has this jerk on each step. The difference between the acting
/// feedforward acceleration and the true one is a force on the mass.
std::vector<double> errors_under(const FollowingLoop& c, const std::vector<double>& jerk_m_s3) {
  SteppedLoop loop = c.stepped();
  loop.reset();
  const auto late = static_cast<std::size_t>(std::lround(c.loop.delay_s / kFine_s));
  std::vector<double> lagged(c.loop.lags_s.size(), 0.0), commanded(late + 1, 0.0), errors;
  double acceleration = 0, held = 0, force_N = 0;
  for (std::size_t i = 0; i < jerk_m_s3.size(); ++i) {
    if (c.steps > 0 && i % static_cast<std::size_t>(c.steps) == 0) held = acceleration;
    const double next = acceleration + jerk_m_s3[i] * kFine_s;
    // The mean of a step passed through all lags in turn; exact for a held command, second order for a moving one.
    commanded.insert(commanded.begin(), c.steps > 0 ? held : (acceleration + next) / 2);
    commanded.pop_back();
    double input = commanded.back();
    for (std::size_t k = 0; k < lagged.size(); ++k) {
      const double before = lagged[k];
      lagged[k] = input + (before - input) * std::exp(-kFine_s / c.loop.lags_s[k]);
      input = k + 1 < lagged.size() ? (before + lagged[k]) / 2 : lagged[k];
    }
    acceleration = next;
    const double to_N = kMass_kg * (input - acceleration);
    errors.push_back(loop.step(force_N, to_N));
    force_N = to_N;
  }
  return errors;
}

TEST(ReferenceMotion, NoJerkOfItsSizeMakesALargerErrorAndTheWorstComesNear) {
  constexpr double kJerk_m_s3 = 12;
  for (const FollowingLoop& c : following_loops()) {
    SCOPED_TRACE(testing::Message() << c.loop.Kp << "/" << c.loop.Kd << "/" << c.loop.Ki << ", " << c.steps
                                    << " steps");
    const double bound_m = c.part_m({0, 0, kJerk_m_s3});
    double most_m = 0;
    for (const int count : {200, 600, 2000, 6000, 24000}) {
      std::vector<double> once(static_cast<std::size_t>(count), 0.0);
      once[0] = 1;
      const std::vector<double> kernel = errors_under(c, once);
      std::vector<double> worst(kernel.rbegin(), kernel.rend());
      for (double& jerk : worst) jerk = jerk < 0 ? -kJerk_m_s3 : kJerk_m_s3;
      for (const double e : errors_under(c, worst)) most_m = std::max(most_m, std::abs(e));
    }
    EXPECT_LE(most_m, bound_m * 1.003) << "of the steps of the simulation";
    EXPECT_GT(most_m, 0.97 * bound_m);
  }
}

TEST(ReferenceMotion, JumpsAreStartsAwayFromTheSetPoint) {
  for (const FollowingLoop& c : following_loops()) {
    double from_position_m = 0, from_speed_m = 0;
    for (int after = 0; after < std::max(c.steps, 1); ++after) {
      for (const bool is_speed : {false, true}) {
        SteppedLoop loop = c.stepped();
        loop.reset();
        for (int i = 0; i < after; ++i) loop.step(0, 0);
        loop.place(is_speed ? 0 : 0.2, is_speed ? 0.5 : 0);
        double& most_m = is_speed ? from_speed_m : from_position_m;
        if (!is_speed) most_m = std::max(most_m, 0.2);
        for (int i = 0; i < 4000; ++i) most_m = std::max(most_m, std::abs(loop.step(0, 0)));
      }
    }
    const double step_m = c.part_m({0.2, 0, 0}), ramp_m = c.part_m({0, 0.5, 0});
    EXPECT_LE(from_position_m, step_m * (1 + 1e-7));
    EXPECT_GT(from_position_m, 0.97 * step_m);
    EXPECT_LE(from_speed_m, ramp_m * (1 + 1e-7));
    EXPECT_GT(from_speed_m, 0.9 * ramp_m);
    EXPECT_NEAR(c.part_m({0.2, 0.5, 0}), step_m + ramp_m, 1e-12);
  }
}

TEST(ReferenceMotion, LeavesNoBallAndTakesThrustByItsJumpsAndItsAcceleration) {
  const Gains gains =
      parse_gains("schema = \"swarmcert/gains/1\"\n[position]\nLambda = 4\nK = 0.136\n", "gains.toml");
  const FlownLoop loop = {gains, {kMass_kg, 1, 5 * kMass_kg * kGravity_m_s2}};
  DisturbanceSource source;
  source.kind = "declared";
  for (Disturbance& d : source.axis) d.amplitude_N = d.rate_N_s = 0.01;
  source.rate_norm_N_s = 0.01;
  const TrackingReport still = tracking_bounds(loop, source, {});
  source.reference[2].steps_m = 0.05;
  const TrackingReport moving = tracking_bounds(loop, source, {});
  EXPECT_TRUE(still.ball_m && still.saturation.is_proved());
  EXPECT_FALSE(moving.ball_m);
  EXPECT_LT(moving.saturation.margin_N(),
            still.saturation.margin_N() - 0.05 * 48 * kMass_kg);  // Kp = 48 1/s^2
  EXPECT_GT(moving.bounds.back().total_m(), still.bounds.back().total_m() + 0.05 - 1e-9);
  source.reference[2] = {0, 0, 1, 0.5};
  EXPECT_LE(saturation(loop, source, {}).margin_N(), still.saturation.margin_N() - 0.5 * kMass_kg + 1e-12);
  source.reference[2].acceleration_m_s2 = std::numeric_limits<double>::infinity();
  EXPECT_EQ(saturation(loop, source, {}).verdict, Saturation::Verdict::kUndecided);
}

TEST(ReferenceMotion, WhatItDemandsOfTheIntegratorIsNotExceeded) {
  for (const FollowingLoop& c : following_loops()) {
    if (c.loop.Ki == 0) continue;
    OtherErrors other;
    other.reference = {0.2, 0.5, 0};
    const double demand_m_s = c.steps == 0 ? integral_demand_m_s(c.loop, Channel::kForce, other)
                                           : integral_demand_m_s(c.sampled(), Channel::kForce, other);
    double most_m_s = 0;
    // The setpoint may also jump between two samples.
    for (int after = 0; after < std::max(c.steps, 1); ++after) {
      SteppedLoop loop = c.stepped();
      loop.reset();
      for (int i = 0; i < after; ++i) loop.step(0, 0);
      loop.place(0.2, 0.5);
      for (int i = 0; i < 4000; ++i) {
        loop.step(0, 0);
        most_m_s = std::max(most_m_s, std::abs(loop.integral_m_s()));
      }
    }
    EXPECT_LE(most_m_s, demand_m_s * (1 + 1e-7));
    EXPECT_GT(most_m_s, 0.6 * demand_m_s);
  }
}

}  // namespace
}  // namespace swarmcert::stability

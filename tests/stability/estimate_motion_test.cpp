// Errors of the estimates in a swarm: their effect on one vehicle, and simulated swarms stay within their bounds.
#include "stability/bounds/swarms/estimate_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "stability/bounds/swarms/coupled_swarm.h"

namespace swarmcert::stability {
namespace {

constexpr double kMotionStep_s = 1e-3;

/// Loops with at most one lag and no delay, integrated by the explicit midpoint rule on their differential equations,
/// without transfer functions.
class MovingVehicle {
 public:
  explicit MovingVehicle(const AxisLoop& loop) : loop_(loop) {}
  double e = 0, speed = 0, integral = 0, lagged = 0, acceleration = 0;

  void step(double force_N, double velocity_error, double position_error) {
    constexpr int kParts = 4;
    for (int i = 0; i < kParts; ++i) part(force_N, velocity_error, position_error, kMotionStep_s / kParts);
  }

 private:
  void part(double force_N, double velocity_error, double position_error, double dt) {
    const auto command = [&](double at, double rate, double sum) {
      return -(loop_.Kp * (at + position_error) + loop_.Kd * (rate + velocity_error) + loop_.Ki * sum) +
             force_N / loop_.mass_kg;
    };
    const bool lags = !loop_.lags_s.empty();
    const auto slope = [&](double at, double rate, double sum, double lag) {
      const double u = command(at, rate, sum);
      return std::vector<double>{rate, lags ? lag : u, at + position_error,
                                 lags ? (u - lag) / loop_.lags_s[0] : 0};
    };
    const auto first = slope(e, speed, integral, lagged);
    const auto middle = slope(e + dt / 2 * first[0], speed + dt / 2 * first[1], integral + dt / 2 * first[2],
                              lagged + dt / 2 * first[3]);
    e += dt * middle[0];
    speed += dt * middle[1];
    integral += dt * middle[2];
    lagged += dt * middle[3];
    acceleration = lags ? lagged : command(e, speed, integral);
  }

  AxisLoop loop_;
};

using MotionCourse = std::vector<double>;

struct MotionReached {
  double e = 0, speed = 0, acceleration = 0;
};

/// Returns the motion of a vehicle under given time histories of estimation errors.
std::vector<MotionReached> motion_under(const AxisLoop& loop, const MotionCourse& velocity,
                                        const MotionCourse& position) {
  MovingVehicle vehicle(loop);
  std::vector<MotionReached> course;
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    vehicle.step(0, velocity[i], position[i]);
    course.push_back({vehicle.e, vehicle.speed, vehicle.acceleration});
  }
  return course;
}

std::vector<AxisLoop> moving_loops() {
  constexpr double kLight_kg = 0.034;
  return {
      {kLight_kg, 10, 5, 10, {1 / 17.4}, 0}, {kLight_kg, 10, 5, 10, {}, 0}, {kLight_kg, 30, 9, 0, {0.03}, 0}};
}

Gains gains_of_pair() {
  return parse_gains("schema = \"swarmcert/gains/1\"\n[position]\nKp = 10\nKd = 5\nKi = 10\n", "g.toml");
}

/// Two vehicles, each pushed by the other's displacement.
CoupledSwarm pair_of(double slope_N_m) {
  CoupledSwarm swarm;
  swarm.vehicles = 2;
  swarm.couplings = {{0, 1, slope_N_m, 0, 0, 0, 0}, {1, 0, slope_N_m, 0, 0, 0, 0}};
  return swarm;
}

TEST(EstimateMotion, IsReachedByTheWorstErrorOfItsSizeAndByNoneExceeded) {
  constexpr double kSize = 0.1;
  constexpr std::size_t kSteps = 8000;
  for (const AxisLoop& loop : moving_loops()) {
    for (const bool is_velocity : {true, false}) {
      OtherErrors errors;
      (is_velocity ? errors.velocity_error : errors.position_error).amplitude = kSize;
      const OwnMotion bound = estimate_motion(loop, errors);
      MotionCourse once(kSteps, 0.0), none(kSteps, 0.0);
      once[0] = 1;
      const std::vector<MotionReached> kernel =
          is_velocity ? motion_under(loop, once, none) : motion_under(loop, none, once);
      for (double MotionReached::*output :
           {&MotionReached::e, &MotionReached::speed, &MotionReached::acceleration}) {
        MotionCourse worst(kSteps);
        for (std::size_t i = 0; i < kSteps; ++i)
          worst[i] = kernel[kSteps - 1 - i].*output < 0 ? -kSize : kSize;
        double most = 0;
        for (const MotionReached& at :
             is_velocity ? motion_under(loop, worst, none) : motion_under(loop, none, worst))
          most = std::max(most, std::abs(at.*output));
        const double limit = output == &MotionReached::e       ? bound.error_m
                             : output == &MotionReached::speed ? bound.speed_m_s
                                                               : bound.acceleration_m_s2;
        EXPECT_LE(most, 1.005 * limit) << loop.Ki << is_velocity;
        EXPECT_GT(most, 0.97 * limit) << loop.Ki << is_velocity;
      }
    }
  }
}

TEST(EstimateMotion, ASlowErrorMovesAVehicleByItsRate) {
  const AxisLoop loop = moving_loops()[0];
  OtherErrors errors;
  errors.velocity_error.amplitude = 0.2;
  const OwnMotion fast = estimate_motion(loop, errors);
  errors.velocity_error.rate = 0.02;
  const OwnMotion slow = estimate_motion(loop, errors);
  EXPECT_LT(slow.error_m, fast.error_m);
  // By the velocity error's rate: e' is Kd times the response to a step of acceleration.
  EXPECT_NEAR(slow.speed_m_s,
              0.02 * loop.mass_kg * loop.Kd * continuous_norms(loop, Channel::kCommand).amplitude, 1e-12);
  EXPECT_LT(slow.acceleration_m_s2, fast.acceleration_m_s2);
  errors.velocity_error.amplitude = std::numeric_limits<double>::infinity();
  EXPECT_EQ(estimate_motion(loop, errors).speed_m_s, slow.speed_m_s);
  EstimateError only_impulse;
  only_impulse.amplitude = std::numeric_limits<double>::infinity();
  only_impulse.impulse = 1;
  errors.velocity_error = only_impulse;
  EXPECT_TRUE(std::isinf(estimate_motion(loop, errors).speed_m_s));
}

TEST(EstimateMotion, NoSimulatedSwarmLeavesTheBoundThatContainsTheErrorsOfItsEstimates) {
  const FlownLoop flown = {gains_of_pair(), {0.034}};
  constexpr double kSlope_N_m = 0.06, kSize = 0.1;
  const CoupledSwarm swarm = pair_of(kSlope_N_m);
  OtherErrors errors;
  errors.velocity_error.amplitude = kSize;
  EXPECT_EQ(couple(swarm, flown).small_gain.error_m[0], 0);
  const CoupledVerdict verdict = couple(swarm, flown, errors);
  ASSERT_TRUE(verdict.small_gain.proved);
  EXPECT_GT(verdict.small_gain.error_m[0], verdict.of_estimates.error_m);

  const AxisLoop loop = *flown.continuous(2);
  std::mt19937 random(7);
  double most_m = 0, most_rate_N_s = 0;
  for (int run = 0; run < 60; ++run) {
    // Errors that switch near the period of the loop drive the vehicles against each other.
    const double half_s = std::uniform_real_distribution<>(0.3, 2)(random);
    std::vector<MovingVehicle> vehicles(2, MovingVehicle(loop));
    const double sign = run % 2 == 0 ? 1 : -1;
    for (int i = 0; i < 20000; ++i) {
      const bool up = std::fmod(i * kMotionStep_s, 2 * half_s) < half_s;
      const double n = up ? kSize : -kSize;
      const double apart_m = vehicles[0].e - vehicles[1].e;
      most_rate_N_s = std::max(most_rate_N_s, kSlope_N_m * std::abs(vehicles[0].speed - vehicles[1].speed));
      vehicles[0].step(sign * kSlope_N_m * apart_m, n, 0);
      vehicles[1].step(-sign * kSlope_N_m * apart_m, -n, 0);
      most_m = std::max(most_m, std::abs(vehicles[0].e));
    }
  }
  EXPECT_LE(most_m, verdict.small_gain.error_m[0]);
  EXPECT_LE(most_rate_N_s, verdict.small_gain.rate_N_s[0]);
  EXPECT_GT(most_m, 0.4 * verdict.small_gain.error_m[0]);
  EXPECT_GT(most_rate_N_s, 0.4 * verdict.small_gain.rate_N_s[0]);
}

TEST(ForceMotion, IsReachedByTheWorstForceOfItsSizeAndByNoneExceeded) {
  constexpr double kSize_N = 0.01;
  constexpr std::size_t kSteps = 12000;
  for (const AxisLoop& loop : moving_loops()) {
    Disturbance force;
    force.amplitude_N = kSize_N;
    const OwnMotion bound = force_motion(loop, force, 0);
    const auto under = [&loop](const MotionCourse& course) {
      MovingVehicle vehicle(loop);
      std::vector<MotionReached> result;
      for (const double force_N : course) {
        vehicle.step(force_N, 0, 0);
        result.push_back({vehicle.e, vehicle.speed, vehicle.acceleration});
      }
      return result;
    };
    MotionCourse once(kSteps, 0.0);
    once[0] = 1;
    const std::vector<MotionReached> kernel = under(once);
    for (const auto& [output, limit] :
         {std::pair(&MotionReached::e, bound.error_m), std::pair(&MotionReached::speed, bound.speed_m_s),
          std::pair(&MotionReached::acceleration, bound.acceleration_m_s2)}) {
      MotionCourse worst(kSteps);
      for (std::size_t i = 0; i < kSteps; ++i)
        worst[i] = kernel[kSteps - 1 - i].*output < 0 ? -kSize_N : kSize_N;
      double most = 0;
      for (const MotionReached& at : under(worst)) most = std::max(most, std::abs(at.*output));
      EXPECT_LE(most, 1.005 * limit) << loop.Ki;
      EXPECT_GT(most, 0.97 * limit) << loop.Ki;
    }
    // A constant force displaces a vehicle permanently if there is no integrator.
    const MotionCourse constant(kSteps, kSize_N);
    EXPECT_NEAR(std::abs(under(constant).back().e), force_motion(loop, no_force(), kSize_N).error_m,
                1e-3 * kSize_N);
  }
}

TEST(ForceMotion, ASlowForceMovesAVehicleByItsRateAndAnEdgeByItsSize) {
  const AxisLoop loop = moving_loops()[0];
  Disturbance force;
  force.rate_N_s = 0.01;
  const OwnMotion slow = force_motion(loop, force, 0);
  EXPECT_NEAR(slow.error_m, 0.01 * rate_gains(loop).position, 1e-12);
  EXPECT_NEAR(slow.speed_m_s, 0.01 * rate_gains(loop).velocity, 1e-9);
  Disturbance edge, amplitude;
  edge.variation_N = amplitude.amplitude_N = 0.02;
  EXPECT_EQ(force_motion(loop, edge, 0).error_m, force_motion(loop, amplitude, 0).error_m);
  Disturbance impulse;
  impulse.impulse_N_s = 1;
  EXPECT_TRUE(std::isinf(force_motion(loop, impulse, 0).error_m));
}

TEST(ForceMotion, NoSimulatedSwarmLeavesTheBoundThatContainsItsForces) {
  const FlownLoop flown = {gains_of_pair(), {0.034}};
  constexpr double kSlope_N_m = 0.06, kSize_N = 0.01;
  const CoupledSwarm swarm = pair_of(kSlope_N_m);
  Disturbance force;
  force.amplitude_N = kSize_N;
  const CoupledVerdict verdict = couple(swarm, flown, {}, force);
  ASSERT_TRUE(verdict.small_gain.proved);
  EXPECT_GT(verdict.small_gain.error_m[0], verdict.of_force.error_m);
  const AxisLoop loop = *flown.continuous(2);
  double most_m = 0;
  for (int run = 0; run < 40; ++run) {
    const double half_s = 0.2 + 0.05 * run;
    std::vector<MovingVehicle> vehicles(2, MovingVehicle(loop));
    for (int i = 0; i < 20000; ++i) {
      const double n = std::fmod(i * kMotionStep_s, 2 * half_s) < half_s ? kSize_N : -kSize_N;
      const double apart_m = vehicles[0].e - vehicles[1].e;
      vehicles[0].step(kSlope_N_m * apart_m + n, 0, 0);
      vehicles[1].step(-kSlope_N_m * apart_m - n, 0, 0);
      most_m = std::max(most_m, std::abs(vehicles[0].e));
    }
  }
  EXPECT_LE(most_m, verdict.small_gain.error_m[0]);
  EXPECT_GT(most_m, 0.4 * verdict.small_gain.error_m[0]);
}

}  // namespace
}  // namespace swarmcert::stability

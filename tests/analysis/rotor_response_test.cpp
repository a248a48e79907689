/// Which motor turns a vehicle which way, seen in logs of vehicles whose motors are numbered in any order.
#include "analysis/identification/rotor_response.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace swarmcert::identification {
namespace {

constexpr double kArm_m = 0.05;

/// An X of four: front right, back left (one sense of rotation), front left, back right (the other).
std::vector<stability::RotorPlace> rotors_in(const std::array<int, 4>& order,
                                             bool first_is_counterclockwise) {
  const double d = kArm_m * std::sqrt(0.5);
  const std::vector<stability::RotorPlace> all = {{d, -d, 0, first_is_counterclockwise},
                                                  {-d, d, 0, first_is_counterclockwise},
                                                  {d, d, 0, !first_is_counterclockwise},
                                                  {-d, -d, 0, !first_is_counterclockwise}};
  std::vector<stability::RotorPlace> rotors;
  for (const int k : order) rotors.push_back(all[static_cast<std::size_t>(k)]);
  return rotors;
}

/// 30 s at 100 Hz: commands about hover, rates that follow from their torques, with noise.
/// @param own how far the motors move apart; 0: they move together
logs::Log log_of(const std::vector<stability::RotorPlace>& rotors, double own) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  logs::Log log;
  log.signals.motor_commands = 4;
  log.signals.rates = true;
  log.hover_command = 0.5;
  log.motor_power = 2;
  std::array<double, 4> deviation{};
  std::array<double, 3> rates{};
  for (int i = 0; i < 3000; ++i) {
    logs::Sample sample;
    sample.time_us = 1e4 * i;
    sample.restarts = i == 0;
    const double common = 0.02 * normal(generator);
    std::array<double, 3> torque{};
    for (std::size_t k = 0; k < 4; ++k) {
      deviation[k] += 0.2 * (own * 0.03 * normal(generator) - deviation[k]);
      const double command = 0.5 + common + deviation[k], force = std::pow(command / 0.5, 2);
      sample.motor_command[k] = static_cast<float>(command);
      torque[0] += 2000 * rotors[k].y_m * force;
      torque[1] -= 2000 * rotors[k].x_m * force;
      torque[2] += rotors[k].counterclockwise ? -12 * force : 12 * force;
    }
    for (std::size_t a = 0; a < 3; ++a) {
      rates[a] += 0.01 * (torque[a] - 3 * rates[a]);
      sample.rates_rad_s[a] = rates[a] + 0.002 * normal(generator);
    }
    log.samples.push_back(sample);
  }
  return log;
}

TEST(RotorResponse, ShowsThePlaceAndSpinOfEveryMotorWhateverTheirOrder) {
  std::array<int, 4> order = {0, 1, 2, 3};
  do {
    for (const bool first : {true, false}) {
      const std::vector<stability::RotorPlace> truth = rotors_in(order, first);
      const logs::Log log = log_of(truth, 1);
      const auto response = rotor_response(log, std::vector<char>(log.samples.size(), 1));
      ASSERT_TRUE(response.has_value());
      const std::vector<stability::RotorPlace> seen = places_of(*response, kArm_m);
      ASSERT_EQ(seen.size(), 4U);
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_DOUBLE_EQ(seen[k].x_m, truth[k].x_m) << k;
        EXPECT_DOUBLE_EQ(seen[k].y_m, truth[k].y_m) << k;
        EXPECT_EQ(seen[k].counterclockwise, truth[k].counterclockwise) << k;
      }
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(RotorResponse, SaysNothingWhereAllMotorsMoveTogetherOrNothingFlies) {
  const logs::Log log = log_of(rotors_in({0, 1, 2, 3}, true), 0);
  const auto together = rotor_response(log, std::vector<char>(log.samples.size(), 1));
  EXPECT_TRUE(!together || places_of(*together, kArm_m).empty());
  EXPECT_FALSE(rotor_response(log, std::vector<char>(log.samples.size(), 0)).has_value());
}

}  // namespace
}  // namespace swarmcert::identification

/// @file Random flight states, for properties that hold at all states.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::tests {

/// A vehicle with `count` neighbours around it, some above, some below, some far.
struct RandomInstant {
  RandomInstant(std::mt19937_64& random, int count) {
    const auto uniform = [&random](double lower, double upper) {
      return std::uniform_real_distribution<double>(lower, upper)(random);
    };
    const auto vector = [&uniform](double size) {
      return Eigen::Vector3d(uniform(-size, size), uniform(-size, size), uniform(-size, size));
    };
    now.time_s = uniform(0, 60);
    now.p_W_m = {uniform(-1, 1), uniform(-1, 1), uniform(0.05, 1.2)};
    now.v_W_m_s = vector(1.5);
    now.R_WB = (Eigen::AngleAxisd(uniform(-3, 3), Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(uniform(-0.6, 0.6), Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
    now.omega_B_rad_s = vector(3);
    now.thrust_N = uniform(0.1, 0.7);
    now.torque_B_Nm = vector(1e-3);
    now.battery_V = uniform(3.2, 4.2);
    now.mass_kg = uniform(0.03, 0.07);
    for (int j = 0; j < count; ++j) {
      const Eigen::Vector3d v = vector(1);
      neighbours.push_back(
          {vector(j % 2 == 0 ? 0.3 : 0.8), v - now.v_W_m_s, v, j % 3 == 0 ? 0.067 : 0.034, 0});
    }
    now.neighbours = neighbours.data();
    now.num_neighbours = count;
  }
  RandomInstant(const RandomInstant&) = delete;
  RandomInstant& operator=(const RandomInstant&) = delete;

  std::vector<stability::Neighbour> neighbours;
  stability::Instant now;
};

}  // namespace swarmcert::tests

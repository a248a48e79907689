/// @file A Crazyflie's control step with values typical of flight.
#pragma once

#include <cstdint>

#include "controller/flight_controller.h"

namespace swarmcert::tests {

using Settings = controller::FlightSettings<float, controller::PidGains<float>>;

/// Gains and calibration of the small vehicle used in flight.
inline Settings crazyflie_settings() {
  Settings settings{};
  settings.mass_kg = 0.034f;
  settings.inertia_kg_m2 =
      controller::diagonal(controller::Vector3<float>{16.57171e-6f, 16.655602e-6f, 29.261652e-6f});
  settings.position = {{20, 20, 10}, {10, 10, 5}, {3, 3, 10}};
  settings.integrator = {{0.1f, 0.1f, 0.1f}, 0.002f};
  settings.lee = {{7e-3f, 7e-3f, 8e-3f}, {1.15e-3f, 1.15e-3f, 2e-3f}};
  settings.robust = {{10, 10, 4}, {5e-4f, 5e-4f, 1e-3f}, {2.5e-4f, 2.5e-4f, 5e-4f}, {2, 2, 2}};
  settings.attitude_step_s = 0.002f;
  settings.thrust_map = {11.0933585f, -39.0810417f, -9.5256471f, 20.5733023f, 38.4288507f};
  settings.largest_force = {-9.8557744f, 3.0164757f, 26.7163688f, 8.0f, 25.0f};
  settings.idle_force_N = 0.005f;
  settings.allocation = controller::allocation(controller::crazyflie_rotors(0.046f, 0.006f));
  return settings;
}

/// Random states; every third state is far from the reference, so that rotors saturate.
class FlightCase {
 public:
  bool is_lee() const { return count_ % 2 == 0; }

  void next() {
    ++count_;
    const float size = count_ % 3 == 0 ? 1.0f : 0.05f;
    settings_.attitude_law = is_lee() ? controller::AttitudeLaw::kLee : controller::AttitudeLaw::kRobust;
    measured_ = {};
    measured_.position_W_m = vector(size);
    measured_.velocity_W_m_s = vector(2 * size);
    controller::Vector3<float> axis = vector(size);
    axis.z = 1;
    const auto heading = controller::heading_of_yaw(unit());
    measured_.attitude.R_WB =
        controller::attitude_of_axis(controller::divided(axis, controller::norm(axis)), heading).R_WR;
    measured_.attitude.omega_B_rad_s = vector(5 * size);
    measured_.battery_V = 3.8f;
    reference_ = {};
    reference_.heading = heading;
    effect_W_N_ = vector(0.05f);
  }

  void step(bool position_is_due) {
    command_ =
        controller::flight_step(settings_, memory_, measured_, reference_, effect_W_N_, 0u, position_is_due);
  }

  /// The last command; using it keeps the compiler from removing the step.
  const controller::FlightCommand<float>& command() const { return command_; }

 private:
  float unit() {
    state_ = state_ * 1664525u + 1013904223u;
    return static_cast<float>(static_cast<std::int32_t>(state_ >> 8) - (1 << 23)) * 0x1p-23f;
  }
  controller::Vector3<float> vector(float largest) {
    controller::Vector3<float> v;
    v.x = largest * unit();
    v.y = largest * unit();
    v.z = largest * unit();
    return v;
  }

  std::uint32_t state_ = 7;
  int count_ = 0;
  Settings settings_ = crazyflie_settings();
  controller::FlightMemory<float> memory_;
  controller::Measured<float> measured_{};
  controller::FlightReference<float> reference_{};
  controller::Vector3<float> effect_W_N_{};
  controller::FlightCommand<float> command_;
};

}  // namespace swarmcert::tests

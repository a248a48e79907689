/// @file Inputs of the Crazyflie app, period by period: a flight that reaches every part of it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace swarmcert::firmware {

inline constexpr int kAppPeers = 10;

/// The app's parameters, in the order of SwarmcertParameters.
struct AppParameters {
  std::uint8_t enable = 0, own_kind = 0;
  float mass_kg = 0;
  std::array<float, 6> gains = {};  ///< kp_xy, kp_z, kd_xy, kd_z, ki_xy, ki_z
};

struct AppPeer {
  std::uint8_t id = 0;
  std::uint32_t stamp_ms = 0;
  std::array<float, 3> position_W_m = {};
};

/// One call: of the controller, with set point and state, or of one period of the task that runs the network.
struct Tick {
  bool is_of_network = false;
  bool initialises = false;  ///< controllerOutOfTreeInit() first
  std::uint32_t now_ms = 0, step = 0;
  AppParameters parameters;
  std::uint8_t self_test = 1;  ///< SwarmcertSelfTest as the call finds it; 1: passed
  float battery_V = 4;
  std::array<float, 6> estimate = {};  ///< own position and velocity, as the task reads them
  std::array<AppPeer, kAppPeers> peers;
  // Set point, in the firmware's units; modes are 0 disabled, 1 absolute, 2 velocity.
  std::array<std::uint8_t, 5> modes = {1, 1, 1, 1, 0};  ///< x, y, z, yaw, quaternion
  float yaw_deg = 0, thrust = 0;
  std::array<float, 3> rates_deg_s = {}, position_m = {}, velocity_m_s = {}, acceleration_m_s2 = {};
  std::array<float, 4> wanted_quaternion = {0, 0, 0, 1};
  // Sensors and state.
  std::array<float, 3> gyro_deg_s = {}, state_position_m = {}, state_velocity_m_s = {};
  std::array<float, 4> state_quaternion = {0, 0, 0, 1};
};

/// What a call leaves: the words of the motors' forces, the control mode, and the members of SwarmcertStatus. NaN has
/// one form.
using TickResult = std::array<std::uint32_t, 13>;

/// Returns a flight whose periods reach the network with zero to ten neighbours inside and outside of its clamp,
/// stale and fading neighbours, saturated motors, every mode of the set point, and every fault.
/// @param normal the parameters at start; some periods change them.
std::vector<Tick> golden_flight(const AppParameters& normal, int periods, std::uint64_t seed);

}  // namespace swarmcert::firmware

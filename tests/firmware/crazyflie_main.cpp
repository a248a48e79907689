// The app of controller/crazyflie against a stub of the stock firmware, on the host and under QEMU. Exit code: 0; the
// line of the first failed check, as far as it fits into a byte; or 100 + the self-test's verdict if that failed.
#include <cstring>

#include "controller/flight_controller.h"
#include "controller/neighbours.h"
#include "network_task.h"
#include "shared.h"
#include "stub.h"

#ifndef __arm__
#include <cstdio>
#endif

using namespace swarmcert::tests::stub;

namespace {

state_t level_state() {
  state_t state{};
  state.attitudeQuaternion.w = 1;
  state.position = {0, own[0], own[1], own[2]};
  state.velocity = {0, own[3], own[4], own[5]};
  return state;
}

setpoint_t hover_setpoint() {
  setpoint_t setpoint{};
  setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = setpoint.mode.yaw = modeAbs;
  setpoint.position = {0, own[0], own[1], own[2]};
  return setpoint;
}

control_t fly(const setpoint_t& setpoint, const state_t& state) {
  control_t control{};
  const sensorData_t sensors{};
  controllerOutOfTreeInit();
  controllerOutOfTree(&control, &setpoint, &sensors, &state, 0);
  return control;
}

float sum(const control_t& control) {
  float total = 0;
  for (const float force : control.normalizedForces) total += force;
  return total;
}

/// A neighbour half a metre above, visible for long enough to have full weight.
void meet_a_neighbour() {
  for (int i = 0; i < 30; ++i) {
    now_ms += swarmcert::crazyflie::kPeriod_ms;
    peers[3] = {7, {now_ms, 0.05f, 0, 1.5f}};
    swarmcert::crazyflie::step_network(now_ms);
  }
}

/// Simulates a rigid body under the commanded PWM, without lag or air, for four seconds of the 1000 Hz loop. It
/// starts half a metre off, tilted, rotating and with another heading. Returns the distance from the setpoint in
/// metres; 1000 if it is not level.
float distance_after_four_seconds() {
  namespace controller = swarmcert::controller;
  constexpr float kStep_s = 1e-3f, kMass_kg = 0.034f, kDegreePerRadian = 57.29578f;
  constexpr float kInertia_kg_m2[3] = {16.57171e-6f, 16.655602e-6f, 29.261652e-6f};
  const controller::ThrustMap<float> map{11.0933585f, -39.0810417f, -9.5256471f, 20.5733023f, 38.4288507f};
  const auto rotors = controller::crazyflie_rotors(0.046f, 0.006f);
  const setpoint_t setpoint = hover_setpoint();
  state_t state = level_state();
  state.position.x += 0.4f;
  state.position.z -= 0.3f;
  state.attitudeQuaternion = {0, 0.2f, -0.1f, 0.3f, 0.927f};
  float omega_rad_s[3] = {1, -1, 0.5f};
  control_t control{};
  controllerOutOfTreeInit();
  for (stabilizerStep_t step = 0; step < 4000; ++step) {
    sensorData_t sensors{};
    sensors.gyro = {kDegreePerRadian * omega_rad_s[0], kDegreePerRadian * omega_rad_s[1],
                    kDegreePerRadian * omega_rad_s[2]};
    controllerOutOfTree(&control, &setpoint, &sensors, &state, step);
    controller::RotorForces<float> forces;
    for (int i = 0; i < 4; ++i)
      forces.at_N[i] = controller::force_of_pwm(map, control.normalizedForces[i], battery_V);
    const controller::Wrench<float> wrench = controller::wrench(rotors, forces);
    const float torque_N_m[3] = {wrench.torque_N_m.x, wrench.torque_N_m.y, wrench.torque_N_m.z};
    float omega_dot[3];
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      omega_dot[i] =
          (torque_N_m[i] - (kInertia_kg_m2[k] - kInertia_kg_m2[j]) * omega_rad_s[j] * omega_rad_s[k]) /
          kInertia_kg_m2[i];
    }
    for (int i = 0; i < 3; ++i) omega_rad_s[i] += kStep_s * omega_dot[i];
    quaternion_t& q = state.attitudeQuaternion;
    const float h = 0.5f * kStep_s;
    const float a = omega_rad_s[0], b = omega_rad_s[1], c = omega_rad_s[2];
    q = {0, q.x + h * (q.w * a + q.y * c - q.z * b), q.y + h * (q.w * b + q.z * a - q.x * c),
         q.z + h * (q.w * c + q.x * b - q.y * a), q.w - h * (q.x * a + q.y * b + q.z * c)};
    const float n = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    const float per_mass = wrench.thrust_N / (kMass_kg * n);
    state.velocity.x += kStep_s * per_mass * 2 * (q.x * q.z + q.w * q.y);
    state.velocity.y += kStep_s * per_mass * 2 * (q.y * q.z - q.w * q.x);
    state.velocity.z += kStep_s * (per_mass * (q.w * q.w - q.x * q.x - q.y * q.y + q.z * q.z) - 9.81f);
    state.position.x += kStep_s * state.velocity.x;
    state.position.y += kStep_s * state.velocity.y;
    state.position.z += kStep_s * state.velocity.z;
  }
  const quaternion_t& q = state.attitudeQuaternion;
  const float tilt = q.x * q.x + q.y * q.y, turn = q.z * q.z;
  if (!(tilt < 1e-3f && turn < 1e-3f)) return 1000;
  const float x = state.position.x - own[0], y = state.position.y - own[1], z = state.position.z - own[2];
  return controller::square_root(x * x + y * y + z * z);
}

bool has(const stub_variable* group, const char* name, std::uint8_t type, const volatile void* address) {
  for (; group->name != nullptr; ++group) {
    if (std::strcmp(group->name, name) == 0) return group->type == type && group->address == address;
  }
  return false;
}

}  // namespace

#define CHECK(condition) \
  if (!(condition)) return __LINE__

int check_app() {
  SwarmcertParameters& parameters = swarmcert_parameters;
  volatile SwarmcertStatus& status = swarmcert_status;
  controllerOutOfTreeInit();
  if (!controllerOutOfTreeTest()) return 100 + status.self_test;

  // Hover at the setpoint: level, four equal motors, and thrust equal to the weight.
  CHECK(parameters.enable == kSwarmcertOff);
  const control_t hover = fly(hover_setpoint(), level_state());
  CHECK(hover.controlMode == controlModeForce);
  for (const float force : hover.normalizedForces)
    CHECK(force == hover.normalizedForces[0] && force > 0.3f && force < 0.9f);

  // The vehicle flies with the default settings.
  CHECK(distance_after_four_seconds() < 0.05f);

  // Every second tick of the 1000 Hz loop is skipped and leaves the command unchanged.
  control_t untouched{};
  untouched.normalizedForces[2] = 0.125f;
  const setpoint_t setpoint = hover_setpoint();
  const state_t state = level_state();
  const sensorData_t sensors{};
  controllerOutOfTree(&untouched, &setpoint, &sensors, &state, 1);
  CHECK(untouched.normalizedForces[2] == 0.125f && untouched.controlMode == controlModeLegacy);

  // Off: nothing is computed. Compute only: logged, not applied. Apply: the thrust compensates for the predicted force.
  meet_a_neighbour();
  CHECK(status.predicted_N == 0 && status.neighbours == 0);
  parameters.enable = kSwarmcertComputeOnly;
  meet_a_neighbour();
  CHECK(status.neighbours == 1 && status.predicted_N != 0);
  CHECK(sum(fly(hover_setpoint(), level_state())) == sum(hover) && status.applied_N == 0);
  parameters.enable = kSwarmcertApply;
  const float predicted_N = status.predicted_N;
  const float thrust = sum(fly(hover_setpoint(), level_state()));
  CHECK(status.applied_N == predicted_N);
  CHECK(predicted_N < 0 ? thrust > sum(hover) : thrust < sum(hover));

  // Any other value is off.
  parameters.enable = 3;
  CHECK(sum(fly(hover_setpoint(), level_state())) == sum(hover) && status.applied_N == 0);
  parameters.enable = kSwarmcertApply;

  // The task hangs: its last prediction is used only for a short time.
  now_ms += 101;
  CHECK(sum(fly(hover_setpoint(), level_state())) == sum(hover) && status.applied_N == 0);

  // The neighbour is no longer heard: it is dropped after half a second.
  now_ms += swarmcert::controller::kMaxNeighbourAge_ms;
  swarmcert::crazyflie::step_network(now_ms);
  CHECK(status.neighbours == 0);
  const float without_neighbours_N = status.predicted_N;
  CHECK(without_neighbours_N != predicted_N);

  // A kind of vehicle that the network lacks, or an invalid estimate: f_a_hat = 0.
  meet_a_neighbour();
  CHECK(status.predicted_N != without_neighbours_N);
  parameters.own_kind = 200;
  swarmcert::crazyflie::step_network(now_ms);
  CHECK(status.predicted_N == 0);
  parameters.own_kind = 0;
  own[2] = 1e9f;
  swarmcert::crazyflie::step_network(now_ms);
  CHECK(status.predicted_N == 0 && status.prediction != 0);
  own[2] = 1;

  // Attitude lost: motors off. No setpoint: motors off. Defective battery sensor: the vehicle keeps flying.
  state_t lost = level_state();
  lost.attitudeQuaternion.w = 0;
  CHECK(sum(fly(hover_setpoint(), lost)) == 0 && status.faults != 0);
  CHECK(sum(fly(setpoint_t{}, level_state())) == 0);
  battery_V = 0;
  CHECK(sum(fly(hover_setpoint(), level_state())) > 0);
  battery_V = 3.9f;

  // Turning by a yaw rate: the heading setpoint moves to the left, so the motors that yaw left are stronger.
  setpoint_t turning = hover_setpoint();
  turning.mode.yaw = modeVelocity;
  turning.attitudeRate.yaw = 90;
  const control_t turned = fly(turning, level_state());
  CHECK(turned.normalizedForces[1] + turned.normalizedForces[3] >
        turned.normalizedForces[0] + turned.normalizedForces[2]);

  CHECK(has(stub_param_swarmcert, "enable", PARAM_UINT8, &parameters.enable));
  CHECK(has(stub_param_swarmcert, "kpXY", PARAM_FLOAT, &parameters.kp_xy));
  CHECK(has(stub_log_swarmcert, "fz", LOG_FLOAT, &status.predicted_N));
  CHECK(has(stub_log_swarmcert, "us", LOG_UINT16, &status.network_us));
  CHECK(has(stub_log_swarmcert, "selfTest", LOG_UINT8, &status.self_test));
  return 0;
}

#ifdef __arm__
extern "C" int program() {
  const int line = check_app();
  if (line < 0) appMain();  // never: keeps the task in the image
  return line;
}
#else
int main() {
  const int line = check_app();
  if (line != 0) std::printf("%s %d\n", line > 100 && line < 110 ? "self-test" : "check in line", line);
  return line == 0 ? 0 : line > 100 && line < 110 ? line : 1;
}
#endif

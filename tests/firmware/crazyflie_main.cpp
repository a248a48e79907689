// The app of controller/crazyflie against a stub of the stock firmware, on the host and under QEMU. Exit code: 0, the
// line of the first check that failed as far as it fits into a byte, or 100 + the self-test's verdict where that failed.
#include <cstring>

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

/// A neighbour half a metre above, seen for long enough that it counts in full.
void meet_a_neighbour() {
  for (int i = 0; i < 30; ++i) {
    now_ms += swarmcert::crazyflie::kPeriod_ms;
    peers[3] = {7, {now_ms, 0.05f, 0, 1.5f}};
    swarmcert::crazyflie::step_network(now_ms);
  }
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

  // Hover at the setpoint: level, four equal motors, and as much thrust as weight.
  CHECK(parameters.enable == kSwarmcertOff);
  const control_t hover = fly(hover_setpoint(), level_state());
  CHECK(hover.controlMode == controlModeForce);
  for (const float force : hover.normalizedForces)
    CHECK(force == hover.normalizedForces[0] && force > 0.3f && force < 0.9f);

  // Every other tick of the 1000 Hz loop is skipped, and leaves the command as it is.
  control_t untouched{};
  untouched.normalizedForces[2] = 0.125f;
  const setpoint_t setpoint = hover_setpoint();
  const state_t state = level_state();
  const sensorData_t sensors{};
  controllerOutOfTree(&untouched, &setpoint, &sensors, &state, 1);
  CHECK(untouched.normalizedForces[2] == 0.125f && untouched.controlMode == controlModeLegacy);

  // Off: nothing is computed. Compute only: logged, not applied. Apply: the thrust makes up for the predicted force.
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

  // The task hangs: its last prediction is not used for long.
  now_ms += 101;
  CHECK(sum(fly(hover_setpoint(), level_state())) == sum(hover) && status.applied_N == 0);

  // The neighbour is heard no more: out after half a second.
  now_ms += swarmcert::controller::kMaxNeighbourAge_ms;
  swarmcert::crazyflie::step_network(now_ms);
  CHECK(status.neighbours == 0);
  const float without_neighbours_N = status.predicted_N;
  CHECK(without_neighbours_N != predicted_N);

  // A vehicle of a kind that the network has not, a broken estimate: f_a_hat = 0.
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

  // The attitude is lost: motors off. No setpoint: motors off. A dead battery sensor: still flying.
  state_t lost = level_state();
  lost.attitudeQuaternion.w = 0;
  CHECK(sum(fly(hover_setpoint(), lost)) == 0 && status.faults != 0);
  CHECK(sum(fly(setpoint_t{}, level_state())) == 0);
  battery_V = 0;
  CHECK(sum(fly(hover_setpoint(), level_state())) > 0);
  battery_V = 3.9f;

  // Turning by a yaw rate: the nose is asked for further to the left, so the motors that turn left push more.
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
extern "C" int program() { return check_app(); }
#else
int main() {
  const int line = check_app();
  if (line != 0) std::printf("%s %d\n", line > 100 && line < 110 ? "self-test" : "check in line", line);
  return line == 0 ? 0 : line > 100 && line < 110 ? line : 1;
}
#endif

// Cost of the app of controller/crazyflie with an exported network: lines "NAME INSTRUCTIONS CYCLES TAKEN_BRANCHES".
// For a name with several lines the largest counts. Run under QEMU with the plugin of cycle_model/.
#include "controller/neighbours.h"
#include "controller/trigonometry.h"
#include "measure.h"
#include "network_task.h"
#include "shared.h"
#include "stub.h"
#include "swarmcert_network.h"

using namespace swarmcert::tests::stub;

namespace {

namespace crazyflie = swarmcert::crazyflie;
namespace nn = swarmcert::nn;
using swarmcert::tests::measure;

constexpr int kPeers = PEER_LOCALIZATION_MAX_NEIGHBORS;

std::uint32_t state = 1;
float next() {
  state = state * 1664525u + 1013904223u;
  return static_cast<float>(static_cast<std::int32_t>(state >> 8) - (1 << 23)) * 0x1p-23f;
}

float input[64];
float output[1024], scratch[4096];

void part(const char* name, const nn::Mlp<float>& network) {
  if (network.inputs() > 64 || network.outputs() > 1024 || scratch_size(network) > 4096) return;
  measure(name, [&] { nn::evaluate(network, input, output, scratch); });
}

void parts() {
  static const char* const phi[] = {"phi_0", "phi_1", "phi_2", "phi_3", "phi_4", "phi_5", "phi_6", "phi_7"};
  static const char* const rho[] = {"rho_0", "rho_1", "rho_2", "rho_3", "rho_4", "rho_5", "rho_6", "rho_7"};
  for (float& x : input) x = next();
  const nn::DeepSet<float> set = swarmcert_network::deep_set(0);
  for (int kind = 0; kind < set.num_kinds && kind < 8; ++kind) part(phi[kind], set.phi[kind]);
  if (set.ground != nullptr) part("ground", *set.ground);
  for (int kind = 0; kind < swarmcert_network::kOwnKinds && kind < 8; ++kind)
    part(rho[kind], swarmcert_network::deep_set(kind).rho);
}

/// The set function with one to ten neighbours, of each kind in turn and with all kinds mixed.
void sets() {
  static const char* const names[] = {"set_of_1", "set_of_2", "set_of_3", "set_of_4", "set_of_5",
                                      "set_of_6", "set_of_7", "set_of_8", "set_of_9", "set_of_10"};
  static float inputs[kPeers][swarmcert_network::kInputs];
  nn::Neighbour<float> neighbours[kPeers];
  const float own[4] = {-1, 0, 0, 0};
  for (int own_kind = 0; own_kind < swarmcert_network::kOwnKinds; ++own_kind) {
    for (int kind = -1; kind < swarmcert_network::kNeighbourKinds; ++kind) {
      for (int j = 0; j < kPeers; ++j) {
        for (float& x : inputs[j]) x = next();
        neighbours[j] = {inputs[j], kind < 0 ? j % swarmcert_network::kNeighbourKinds : kind};
      }
      for (int count = 1; count <= kPeers; ++count) {
        float force_N = 0;
        measure(names[count - 1],
                [&] { swarmcert_network::predict_force_z(own_kind, own, neighbours, count, &force_N); });
      }
    }
  }
}

/// Peers visible for half a second: close by, or in the fading zone with different weights, which is the worst case.
void network_task(const char* name, bool fading) {
  for (int i = 0; i < 50; ++i) {
    now_ms += crazyflie::kPeriod_ms;
    for (int j = 0; j < kPeers; ++j) {
      const float along_m = fading ? 0.905f + 0.009f * static_cast<float>(j) : 0.05f * static_cast<float>(j);
      peers[j] = {static_cast<std::uint8_t>(j + 1), {now_ms, along_m, 0.1f, 1.4f}};
    }
    if (i < 49) {
      crazyflie::step_network(now_ms);
    } else {
      measure(name, [] { crazyflie::step_network(now_ms); });
    }
  }
}

void controller() {
  control_t control{};
  sensorData_t sensors{};
  controllerOutOfTreeInit();
  for (int i = 0; i < 200; ++i) {
    state_t flown{};
    const float size = i % 3 == 0 ? 1.0f : 0.05f;
    const auto half = swarmcert::controller::sin_cos(size * next());
    flown.attitudeQuaternion = {0, half.sine, 0, 0, half.cosine};
    flown.position = {0, size * next(), size * next(), 1 + size * next()};
    flown.velocity = {0, size * next(), size * next(), size * next()};
    sensors.gyro = {100 * size * next(), 100 * size * next(), 100 * size * next()};
    setpoint_t setpoint{};
    setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = modeAbs;
    setpoint.mode.yaw = i % 2 == 0 ? modeAbs : modeVelocity;
    setpoint.position.z = 1;
    setpoint.attitudeRate.yaw = 30;
    now_ms += 10;
    measure("controller", [&] { controllerOutOfTree(&control, &setpoint, &sensors, &flown, 0); });
  }
}

}  // namespace

extern "C" int program() {
  swarmcert_parameters.enable = kSwarmcertApply;
  measure("self_test", [] { crazyflie::passes_self_test(); });
  if (swarmcert_status.self_test != kSwarmcertPassed) return 100 + swarmcert_status.self_test;
  parts();
  sets();
  network_task("network_task", false);
  network_task("network_task_fading", true);
  controller();
  return 0;
}

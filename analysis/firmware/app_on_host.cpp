#include "analysis/firmware/app_on_host.h"

// The sources of the app, against the interface of controller/crazyflie/interface and the swarmcert_network.h in
// host_network/, which evaluates any network.
#include <cmath>
#include <cstring>
#include <string>

#include "analysis/firmware/float_blocks.h"
#include "analysis/firmware/golden_vectors.h"
#include "controller/crazyflie/src/flight.cpp"
#include "controller/crazyflie/src/network_task.cpp"
#include "nn/weights/functions.h"

namespace swarmcert::firmware {
namespace {

const SwarmcertParameters kAtStart = swarmcert_parameters;

/// What the firmware's functions below return.
struct World {
  const FlightEvaluator* evaluator = nullptr;
  std::vector<std::string> own_kinds;
  Tick tick;
  peerLocalizationOtherPosition_t peers[kAppPeers] = {};
};
World world;

void copy(const std::array<float, 3>& from, float& x, float& y, float& z) {
  x = from[0], y = from[1], z = from[2];
}

quaternion_t quaternion(const std::array<float, 4>& q) { return {0, q[0], q[1], q[2], q[3]}; }

setpoint_t setpoint_of(const Tick& tick) {
  setpoint_t s{};
  s.attitude.yaw = tick.yaw_deg;
  copy(tick.rates_deg_s, s.attitudeRate.roll, s.attitudeRate.pitch, s.attitudeRate.yaw);
  s.attitudeQuaternion = quaternion(tick.wanted_quaternion);
  s.thrust = tick.thrust;
  copy(tick.position_m, s.position.x, s.position.y, s.position.z);
  copy(tick.velocity_m_s, s.velocity.x, s.velocity.y, s.velocity.z);
  copy(tick.acceleration_m_s2, s.acceleration.x, s.acceleration.y, s.acceleration.z);
  const auto mode = [&tick](std::size_t i) { return static_cast<stub_mode>(tick.modes[i]); };
  s.mode.x = mode(0), s.mode.y = mode(1), s.mode.z = mode(2), s.mode.yaw = mode(3), s.mode.quat = mode(4);
  return s;
}

void set_parameters(const AppParameters& p) {
  const auto& g = p.gains;
  swarmcert_parameters = {p.enable, p.own_kind, p.mass_kg, g[0], g[1], g[2], g[3], g[4], g[5]};
}

std::uint32_t word(float x) { return std::isnan(x) ? 0x7fc00000u : float_bits(x); }

}  // namespace

AppOnHost::AppOnHost(const files::Network& network, int most_neighbours) {
  world = {};
  world.evaluator = new FlightEvaluator(network, most_neighbours);
  for (const auto& [kind, weights] : network.rho) world.own_kinds.push_back(kind);
  swarmcert_network::kOwnKinds = static_cast<int>(world.own_kinds.size());
  std::memset(const_cast<SwarmcertStatus*>(&swarmcert_status), 0, sizeof swarmcert_status);
  for (crazyflie::Peer& peer : crazyflie::peers) peer = {};
  crazyflie::last_effect_W_N = {};
  controllerOutOfTreeInit();
}

AppOnHost::~AppOnHost() {
  delete world.evaluator;
  world.evaluator = nullptr;
}

TickResult AppOnHost::run(const Tick& tick) {
  world.tick = tick;
  for (int i = 0; i < kAppPeers; ++i) {
    const AppPeer& peer = tick.peers[static_cast<std::size_t>(i)];
    const auto& p = peer.position_W_m;
    world.peers[i] = {peer.id, {peer.stamp_ms, p[0], p[1], p[2]}};
  }
  set_parameters(tick.parameters);
  swarmcert_status.self_test = tick.self_test;
  control_t control{};
  if (tick.initialises) controllerOutOfTreeInit();
  if (tick.is_of_network) {
    crazyflie::passes_self_test();  // as appMain() does
    crazyflie::step_network(tick.now_ms);
  } else {
    const setpoint_t setpoint = setpoint_of(tick);
    sensorData_t sensors{};
    copy(tick.gyro_deg_s, sensors.gyro.x, sensors.gyro.y, sensors.gyro.z);
    state_t state{};
    state.attitudeQuaternion = quaternion(tick.state_quaternion);
    copy(tick.state_position_m, state.position.x, state.position.y, state.position.z);
    copy(tick.state_velocity_m_s, state.velocity.x, state.velocity.y, state.velocity.z);
    controllerOutOfTree(&control, &setpoint, &sensors, &state, tick.step);
  }
  const volatile SwarmcertStatus& s = swarmcert_status;
  const auto* const f = control.normalizedForces;
  return {word(f[0]),
          word(f[1]),
          word(f[2]),
          word(f[3]),
          static_cast<std::uint32_t>(control.controlMode),
          s.self_test,
          s.prediction,
          s.neighbours,
          s.faults,
          s.network_us,
          word(s.predicted_N),
          word(s.applied_N),
          s.predicted_ms};
}

std::vector<std::uint32_t> AppOnHost::settings() {
  controllerOutOfTreeInit();
  std::vector<std::uint32_t> words(sizeof(crazyflie::settings) / 4);
  std::memcpy(words.data(), &crazyflie::settings, 4 * words.size());
  return words;
}

AppConstants AppOnHost::constants() {
  controllerOutOfTreeInit();
  const auto& settings = crazyflie::settings;
  const auto& map = settings.thrust_map;
  const auto& inertia = settings.inertia_kg_m2;
  const auto& limit = settings.integrator.limit_m_s;
  return {{"c00", map.c00},
          {"c10", map.c10},
          {"c01", map.c01},
          {"c20", map.c20},
          {"c11", map.c11},
          {"inertia_x_kg_m2", inertia.x.x},
          {"inertia_y_kg_m2", inertia.y.y},
          {"inertia_z_kg_m2", inertia.z.z},
          {"integrator_limit_x_m_s", limit.x},
          {"integrator_limit_y_m_s", limit.y},
          {"integrator_limit_z_m_s", limit.z},
          {"integrator_step_s", settings.integrator.step_s}};
}

AppParameters AppOnHost::defaults() {
  const SwarmcertParameters& p = kAtStart;
  return {p.enable, p.own_kind, p.mass_kg, {p.kp_xy, p.kp_z, p.kd_xy, p.kd_z, p.ki_xy, p.ki_z}};
}

}  // namespace swarmcert::firmware

namespace swarmcert_network {

int kOwnKinds = 0;

SelfTest self_test(int*) { return SelfTest::kPassed; }

swarmcert::nn::DeepSetStatus predict_force_z(int own_kind, const float* own,
                                             const swarmcert::nn::Neighbour<float>* neighbours,
                                             int num_neighbours, float* force_N) {
  using swarmcert::firmware::world;
  *force_N = 0;
  if (own_kind < 0 || own_kind >= kOwnKinds) return swarmcert::nn::DeepSetStatus::kUnknownKind;
  swarmcert::firmware::GoldenVector vector;
  vector.own_kind = own_kind;
  vector.own.assign(own, own + swarmcert::files::kGroundInputs);
  for (int j = 0; j < num_neighbours; ++j) {
    vector.inputs.emplace_back(neighbours[j].input,
                               neighbours[j].input + swarmcert::controller::kNeighbourInputs);
    vector.kinds.push_back(neighbours[j].kind);
  }
  world.evaluator->run(world.own_kinds[static_cast<std::size_t>(own_kind)], vector);
  if (vector.status == swarmcert::nn::DeepSetStatus::kOk) *force_N = vector.force_N;
  return vector.status;
}

}  // namespace swarmcert_network

extern "C" {

TickType_t xTaskGetTickCount() { return swarmcert::firmware::world.tick.now_ms; }
void vTaskDelayUntil(TickType_t*, TickType_t) {}
std::uint64_t usecTimestamp() { return swarmcert::firmware::world.tick.now_ms; }
float pmGetBatteryVoltage() { return swarmcert::firmware::world.tick.battery_V; }
peerLocalizationOtherPosition_t* peerLocalizationGetPositionByIdx(std::uint8_t index) {
  return &swarmcert::firmware::world.peers[index];
}
logVarId_t logGetVarId(const char*, const char* name) {
  const std::string text = name;
  const auto at = static_cast<logVarId_t>(text.back() - 'x');
  return static_cast<logVarId_t>(text.size() == 2 ? at + 3 : at);
}
float logGetFloat(logVarId_t id) { return swarmcert::firmware::world.tick.estimate[id]; }
}

// The controller that the stock firmware calls a thousand times per second: setpoint and state in, PWM out.
#include <cstddef>
#include <limits>

#include "controller/flight_controller.h"
#include "network_task.h"
#include "shared.h"
#include "upstream.h"

namespace swarmcert::crazyflie {
namespace {

using controller::Vector3;

using Mode = decltype(setpoint_t{}.mode.x);
using Settings = controller::FlightSettings<float, controller::PidGains<float>>;

constexpr float kRadianPerDegree = 0.017453292519943295f;
/// Older predictions come from a task that is no longer running.
constexpr std::uint32_t kMaxPredictionAge_ms = 100;

Settings settings;
controller::FlightMemory<float> memory;
controller::Heading<float> heading;  ///< from the setpoint, or integrated from its yaw rates

/// Crazyflie 2.1: inertia, calibration and gains of the attitude loop as published with the authors' flights.
void set_up() {
  settings = {};
  settings.inertia_kg_m2 = controller::diagonal(Vector3<float>{16.57171e-6f, 16.655602e-6f, 29.261652e-6f});
  settings.integrator = {{0.1f, 0.1f, 0.1f}, 1.0f / POSITION_RATE};
  settings.robust = {{10, 10, 4}, {2e-3f, 2e-3f, 1e-3f}, {2e-3f, 2e-3f, 4e-3f}, {2, 2, 2}};
  settings.attitude_step_s = 1.0f / ATTITUDE_RATE;
  settings.thrust_map = {11.0933585f, -39.0810417f, -9.5256471f, 20.5733023f, 38.4288507f};
  settings.largest_force = {-9.8557744f, 3.0164757f, 26.7163688f, 8.0f, 25.0f};
  settings.idle_force_N = 0.005f;
  settings.allocation = controller::allocation(controller::crazyflie_rotors(0.046f, 0.006f));
}

void take_parameters() {
  const SwarmcertParameters& p = swarmcert_parameters;
  settings.mass_kg = p.mass_kg;
  settings.position = {{p.kp_xy, p.kp_xy, p.kp_z}, {p.kd_xy, p.kd_xy, p.kd_z}, {p.ki_xy, p.ki_xy, p.ki_z}};
}

/// Returns the rotation matrix of a quaternion divided by its norm, since estimators let the norm drift.
controller::Matrix3<float> rotation(const quaternion_t& q) {
  using nn::rounded;
  const float xx = rounded(q.x * q.x), yy = rounded(q.y * q.y), zz = rounded(q.z * q.z),
              ww = rounded(q.w * q.w);
  const float s = 2.0f / (((xx + yy) + zz) + ww);
  const float xy = rounded(q.x * q.y), xz = rounded(q.x * q.z), yz = rounded(q.y * q.z);
  const float wx = rounded(q.w * q.x), wy = rounded(q.w * q.y), wz = rounded(q.w * q.z);
  return {{1.0f - rounded(s * (yy + zz)), rounded(s * (xy - wz)), rounded(s * (xz + wy))},
          {rounded(s * (xy + wz)), 1.0f - rounded(s * (xx + zz)), rounded(s * (yz - wx))},
          {rounded(s * (xz - wy)), rounded(s * (yz + wx)), 1.0f - rounded(s * (xx + yy))}};
}

/// Returns the direction of the nose of R_WB, seen from above; straight ahead if it points up or down.
controller::Heading<float> heading_of(const controller::Matrix3<float>& R_WB) {
  const float c = R_WB.x.x, s = R_WB.y.x;
  const float length = controller::square_root(nn::rounded(c * c) + nn::rounded(s * s));
  if (!(length > 1e-3f)) return {};
  return {c / length, s / length};
}

/// Returns `from`, rotated by a small angle.
controller::Heading<float> turned(const controller::Heading<float>& from, float angle_rad) {
  const controller::SineCosine<float> by = controller::sin_cos(angle_rad);
  const float c = nn::rounded(from.cosine * by.cosine) - nn::rounded(from.sine * by.sine);
  const float s = nn::rounded(from.sine * by.cosine) + nn::rounded(from.cosine * by.sine);
  const float length = controller::square_root(nn::rounded(c * c) + nn::rounded(s * s));
  return {c / length, s / length};
}

/// Reads one axis of the setpoint. Modes without a position or velocity (attitude control) are not supported: they give
/// NaN, upon which flight_step() holds the position.
void take_axis(Mode mode, float position_m, float velocity_m_s, float measured_m, float& wanted_m,
               float& wanted_m_s) {
  wanted_m_s = velocity_m_s;
  if (mode == modeAbs) {
    wanted_m = position_m;
  } else if (mode == modeVelocity) {
    wanted_m = measured_m;
  } else {
    wanted_m = std::numeric_limits<float>::quiet_NaN();
  }
}

controller::FlightReference<float> reference_of(const setpoint_t& setpoint,
                                                const controller::Measured<float>& measured) {
  controller::FlightReference<float> r{};
  const Vector3<float>& p = measured.position_W_m;
  take_axis(setpoint.mode.x, setpoint.position.x, setpoint.velocity.x, p.x, r.position_W_m.x,
            r.velocity_W_m_s.x);
  take_axis(setpoint.mode.y, setpoint.position.y, setpoint.velocity.y, p.y, r.position_W_m.y,
            r.velocity_W_m_s.y);
  take_axis(setpoint.mode.z, setpoint.position.z, setpoint.velocity.z, p.z, r.position_W_m.z,
            r.velocity_W_m_s.z);
  r.acceleration_W_m_s2 = {setpoint.acceleration.x, setpoint.acceleration.y, setpoint.acceleration.z};
  const float yaw_rate_rad_s = nn::rounded(setpoint.attitudeRate.yaw * kRadianPerDegree);
  if (setpoint.mode.quat == modeAbs) {
    heading = r.heading = heading_of(rotation(setpoint.attitudeQuaternion));
    r.omega_R_rad_s = {nn::rounded(setpoint.attitudeRate.roll * kRadianPerDegree),
                       nn::rounded(setpoint.attitudeRate.pitch * kRadianPerDegree), yaw_rate_rad_s};
    return r;
  }
  if (setpoint.mode.yaw == modeVelocity) {
    heading = turned(heading, nn::rounded(yaw_rate_rad_s * settings.attitude_step_s));
    r.omega_R_rad_s.z = yaw_rate_rad_s;
  } else {
    heading = controller::heading_of_yaw(nn::rounded(setpoint.attitude.yaw * kRadianPerDegree));
  }
  r.heading = heading;
  return r;
}

controller::Measured<float> measured_of(const sensorData_t& sensors, const state_t& state,
                                        std::uint32_t now_ms) {
  controller::Measured<float> m{};
  m.position_W_m = {state.position.x, state.position.y, state.position.z};
  m.velocity_W_m_s = {state.velocity.x, state.velocity.y, state.velocity.z};
  m.attitude.R_WB = rotation(state.attitudeQuaternion);
  m.attitude.omega_B_rad_s = {nn::rounded(sensors.gyro.x * kRadianPerDegree),
                              nn::rounded(sensors.gyro.y * kRadianPerDegree),
                              nn::rounded(sensors.gyro.z * kRadianPerDegree)};
  m.position_stamp_ms = now_ms;  // the estimator's state is current
  m.attitude_stamp_ms = now_ms;
  m.battery_V = pmGetBatteryVoltage();
  return m;
}

/// Returns f_a_hat if it may be used: enabled, self-test passed, recent.
Vector3<float> effect(std::uint32_t now_ms) {
  const bool applies = swarmcert_parameters.enable == kSwarmcertApply &&
                       swarmcert_status.self_test == kSwarmcertPassed &&
                       controller::age_ms(now_ms, swarmcert_status.predicted_ms) <= kMaxPredictionAge_ms;
  const float applied_N = applies ? swarmcert_status.predicted_N : 0.0f;
  swarmcert_status.applied_N = applied_N;
  return {0, 0, applied_N};
}

void stop(control_t& control, const state_t& state) {
  memory = {};
  heading = heading_of(rotation(state.attitudeQuaternion));
  for (float& force : control.normalizedForces) force = 0;
}

// The position of the time stamp in a peer's data differs between firmware versions.
template <typename Peer>
constexpr auto stamp_offset(int) -> decltype(Peer::timestamp, std::size_t{}) {
  return offsetof(Peer, timestamp);
}
template <typename Peer>
constexpr std::size_t stamp_offset(long) {
  return offsetof(Peer, pos) + offsetof(point_t, timestamp);
}

}  // namespace
}  // namespace swarmcert::crazyflie

extern "C" {

// Where the firmware's types have the members that the app uses, so that `match` can call it in the linked image:
// analysis/firmware/app_layout.h lists them in this order.
extern const std::uint16_t swarmcert_layout[];
const std::uint16_t swarmcert_layout[] = {
    1,
    sizeof(setpoint_t),
    offsetof(setpoint_t, attitude.yaw),
    offsetof(setpoint_t, attitudeRate.roll),
    offsetof(setpoint_t, attitudeQuaternion.x),
    offsetof(setpoint_t, thrust),
    offsetof(setpoint_t, position.x),
    offsetof(setpoint_t, velocity.x),
    offsetof(setpoint_t, acceleration.x),
    offsetof(setpoint_t, mode.x),
    offsetof(setpoint_t, mode.y),
    offsetof(setpoint_t, mode.z),
    offsetof(setpoint_t, mode.yaw),
    offsetof(setpoint_t, mode.quat),
    sizeof(setpoint_t{}.mode.x),
    sizeof(sensorData_t),
    offsetof(sensorData_t, gyro.x),
    sizeof(state_t),
    offsetof(state_t, attitudeQuaternion.x),
    offsetof(state_t, position.x),
    offsetof(state_t, velocity.x),
    sizeof(control_t),
    offsetof(control_t, normalizedForces),
    offsetof(control_t, controlMode),
    sizeof(control_t{}.controlMode),
    sizeof(peerLocalizationOtherPosition_t),
    offsetof(peerLocalizationOtherPosition_t, id),
    offsetof(peerLocalizationOtherPosition_t, pos.x),
    swarmcert::crazyflie::stamp_offset<peerLocalizationOtherPosition_t>(0),
    PEER_LOCALIZATION_MAX_NEIGHBORS,
};

void controllerOutOfTreeInit() {
  asm volatile("" : : "r"(swarmcert_layout));  // keeps the table in the image
  swarmcert::crazyflie::set_up();
  swarmcert::crazyflie::memory = {};
  swarmcert::crazyflie::heading = {};
}

bool controllerOutOfTreeTest() {
  return swarmcert::crazyflie::settings.allocation.rank == 4 && swarmcert::crazyflie::passes_self_test();
}

void controllerOutOfTree(control_t* control, const setpoint_t* setpoint, const sensorData_t* sensors,
                         const state_t* state, const stabilizerStep_t step) {
  using namespace swarmcert::crazyflie;
  if (!RATE_DO_EXECUTE(ATTITUDE_RATE, step)) return;
  control->controlMode = controlModeForce;
  const bool is_stopped = setpoint->mode.z == modeDisable && setpoint->thrust == 0.0f;
  if (is_stopped) return stop(*control, *state);
  const std::uint32_t now_ms = T2M(xTaskGetTickCount());
  take_parameters();
  const swarmcert::controller::Measured<float> measured = measured_of(*sensors, *state, now_ms);
  const swarmcert::controller::FlightCommand<float> command =
      swarmcert::controller::flight_step(settings, memory, measured, reference_of(*setpoint, measured),
                                         effect(now_ms), now_ms, RATE_DO_EXECUTE(POSITION_RATE, step));
  swarmcert_status.faults = command.faults;
  for (int i = 0; i < STABILIZER_NR_OF_MOTORS; ++i) {
    control->normalizedForces[i] = command.motors_off ? 0.0f : static_cast<float>(command.pwm[i]) / 65535.0f;
  }
}
}

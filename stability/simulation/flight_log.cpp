#include "stability/simulation/flight_log.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "stability/effects/registry.h"

namespace swarmcert::stability {
namespace {

constexpr char kHeader[] =
    "tick(I),stateEstimateZ.x(h),stateEstimateZ.y(h),stateEstimateZ.z(h),stateEstimateZ.vx(h),stateEstimateZ."
    "vy(h),stateEstimateZ.vz(h),stateEstimateZ.ax(h),stateEstimateZ.ay(h),stateEstimateZ.az(h),"
    "stateEstimateZ.quat(I),stateEstimateZ.rateRoll(h),stateEstimateZ.ratePitch(h),stateEstimateZ.rateYaw(h),"
    "ctrltargetZ.x(h),ctrltargetZ.y(h),ctrltargetZ.z(h),ctrltargetZ.vx(h),ctrltargetZ.vy(h),ctrltargetZ.vz(h)"
    ",motor.thrust(f),motor.torquex(f),motor.torquey(f),motor.torquez(f),motor.f1(f),motor.f2(f),motor.f3(f),"
    "motor.f4(f),pwm.m1_pwm(I),pwm.m2_pwm(I),pwm.m3_pwm(I),pwm.m4_pwm(I),pwm.maxThrust(f),pm.vbatMV(H),"
    "ctrlFa.Faz(f),";
constexpr unsigned kVariables = 35;
constexpr std::size_t kRecordsPerBlock = 2;

/// Writes an integer in little-endian order; returns the position after it.
template <typename Integer>
char* put(char* to, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    to[i] = static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xffu);
  }
  return to + sizeof value;
}

char* put(char* to, float value) {
  std::uint32_t bits;
  static_assert(sizeof bits == sizeof value);
  std::memcpy(&bits, &value, sizeof bits);
  return put(to, bits);
}

template <typename T, std::size_t kSize>
char* put(char* to, const std::array<T, kSize>& values) {
  for (const T value : values) to = put(to, value);
  return to;
}

/// Writes NOT crc32 of everything from `begin` on.
char* put_check(char* to, const char* begin) {
  return put(to, static_cast<std::uint32_t>(
                     ~crc32(0, reinterpret_cast<const Bytef*>(begin), static_cast<uInt>(to - begin))));
}

constexpr std::size_t kRecordBytes = 102, kCheckBytes = 4;

char* put(char* to, const LogRecord& record) {
  to = put(to, record.tick_us);
  to = put(to, record.position_mm_velocity_mm_s_acceleration_mm_s2);
  to = put(to, record.quaternion);
  to = put(to, record.rates_mrad_s);
  to = put(to, record.target_mm_mm_s);
  to = put(to, record.thrust_N);
  to = put(to, record.torque_Nm);
  to = put(to, record.motor_N);
  to = put(to, record.pwm);
  to = put(to, record.largest_thrust_gf);
  to = put(to, record.battery_mV);
  return put(to, record.prediction_gf);
}

/// Returns `q` rotated by a small random rotation vector.
Eigen::Quaterniond disturbed(files::Random& random, double angle_rad, const Eigen::Quaterniond& q) {
  const double x = 0.5 * angle_rad * random.bell(), y = 0.5 * angle_rad * random.bell(),
               z = 0.5 * angle_rad * random.bell();
  const Eigen::Quaterniond r(
      q.w() - q.x() * x - q.y() * y - q.z() * z, q.x() + q.w() * x + q.y() * z - q.z() * y,
      q.y() + q.w() * y - q.x() * z + q.z() * x, q.z() + q.w() * z + q.x() * y - q.y() * x);
  const double length = std::sqrt(r.w() * r.w() + r.x() * r.x() + r.y() * r.y() + r.z() * r.z());
  return Eigen::Quaterniond(r.coeffs() / length);
}

/// Returns the product of the model's accelerometer_scale effects.
double accelerometer_scale(const Model& model) {
  double scale = 1;
  for (const EffectSpec& spec : model.effects) {
    if (spec.name == "accelerometer_scale") scale *= effect_values(effect_info(spec.name), spec).linear[0];
  }
  return scale;
}

}  // namespace

std::string to_usd_log(const std::vector<LogRecord>& records) {
  std::string bytes(1, static_cast<char>(kVariables));
  bytes += kHeader;
  const std::size_t head = bytes.size(), blocks = (records.size() + kRecordsPerBlock - 1) / kRecordsPerBlock;
  bytes.resize(head + kCheckBytes + blocks * (1 + kCheckBytes) + records.size() * kRecordBytes);
  char* to = put_check(bytes.data() + head, bytes.data());
  for (std::size_t i = 0; i < records.size(); i += kRecordsPerBlock) {
    const char* const begin = to;
    const std::size_t count = std::min(kRecordsPerBlock, records.size() - i);
    to = put(to, static_cast<std::uint8_t>(count));
    for (std::size_t k = 0; k < count; ++k) to = put(to, records[i + k]);
    to = put_check(to, begin);
  }
  return bytes;
}

FlightRecorder::FlightRecorder(SampledFlight& loop, std::uint64_t seed) : loop_(loop) {
  Swarm& swarm = loop.swarm();
  const double rate_hz = 1 / loop.period_s();
  every_ = std::max(1, static_cast<int>(std::lround(rate_hz / swarm.model(0).sensor.log_rate_hz)));
  derivative_ = swarm.make_rows();
  for (int i = 0; i < swarm.size(); ++i) {
    files::Random random(files::Random(seed + 1000 + static_cast<std::uint64_t>(i)).bits());
    const double start_s = 0.03 * random.uniform();
    const double cutoff_hz = std::min(swarm.model(i).sensor.accelerometer_cutoff_hz, 0.45 * rate_hz);
    const SignalPath& path = swarm.path(i);
    vehicles_.push_back({DelayedSignal(path.sensor_delay_s, path.sensor_delay_gain, loop.period_s()),
                         LowPass(cutoff_hz, rate_hz),
                         random,
                         start_s,
                         {}});
  }
}

void FlightRecorder::listen() {
  Swarm& swarm = loop_.swarm();
  swarm.derivative_in_rows(loop_.time_s(), loop_.rows(), loop_.inputs(), derivative_.data());
  const bool is_due = loop_.period() % every_ == 0;
  for (int i = 0; i < swarm.size(); ++i) {
    Vehicle& vehicle = vehicles_[static_cast<std::size_t>(i)];
    const std::size_t at = row_index(i, kVehicleStateSize);
    const double* const x = loop_.rows() + at + kQuaternion * kRowLength;
    const double* const v_dot = derivative_.data() + at + kVelocity * kRowLength;
    const double q[4] = {x[0], x[kRowLength], x[2 * kRowLength], x[3 * kRowLength]};
    Eigen::Matrix3d R_WB;
    rotation_of(q, &R_WB);
    const Eigen::Vector3d force_W(v_dot[0], v_dot[kRowLength], v_dot[2 * kRowLength] + kGravity_m_s2);
    const Eigen::Vector3d specific_force_B =
        vehicle.accelerometer.filter(R_WB.transpose() * vehicle.delay.filter(force_W));
    if (is_due && loop_.time_s() >= vehicle.start_s)
      vehicle.records.push_back(record(i, vehicle, specific_force_B));
  }
}

LogRecord FlightRecorder::record(int index, Vehicle& vehicle, const Eigen::Vector3d& specific_force_B) {
  const Model& model = loop_.swarm().model(index);
  const SensorModel& sensor = model.sensor;
  const double* const x = loop_.state() + index * kVehicleStateSize;
  const ControlRecord& control = loop_.record(index);
  files::Random& random = vehicle.random;
  constexpr double kJitter_s = 1e-4;

  LogRecord record;
  const double tick_us = 1e6 * (loop_.time_s() - vehicle.start_s + kJitter_s * random.bell());
  record.tick_us = static_cast<std::uint32_t>(std::max(tick_us, 0.0));
  if (!vehicle.records.empty()) record.tick_us = std::max(record.tick_us, vehicle.records.back().tick_us + 1);

  const Eigen::Quaterniond q =
      disturbed(random, sensor.attitude_noise_rad, Eigen::Quaterniond(x + kQuaternion));
  record.quaternion = compress_quaternion(q);
  Eigen::Matrix3d R_WB;
  rotation_of(q.coeffs().data(), &R_WB);
  Eigen::Vector3d acceleration_B = accelerometer_scale(model) * specific_force_B;
  for (int i = 0; i < 3; ++i) acceleration_B[i] += sensor.accelerometer_noise_m_s2 * random.bell();
  const Eigen::Vector3d acceleration_W = R_WB * acceleration_B;
  auto& kinematics = record.position_mm_velocity_mm_s_acceleration_mm_s2;
  for (std::size_t i = 0; i < 3; ++i) {
    kinematics[i] = milli(x[kPosition + i] + sensor.position_noise_m * random.bell());
    kinematics[3 + i] = milli(x[kVelocity + i] + sensor.velocity_noise_m_s * random.bell());
    kinematics[6 + i] = milli(acceleration_W[static_cast<int>(i)]);
    record.rates_mrad_s[i] = milli(x[kOmega + i]);
    record.target_mm_mm_s[i] = milli(control.setpoint.p_W_m[static_cast<int>(i)]);
    record.target_mm_mm_s[3 + i] = milli(control.setpoint.v_W_m_s[static_cast<int>(i)]);
    record.torque_Nm[i] = static_cast<float>(control.torque_B_Nm[static_cast<int>(i)]);
  }
  record.thrust_N = static_cast<float>(control.thrust_N);
  const double battery_V = loop_.input(index).battery_V;
  for (std::size_t r = 0; r < kNumRotors; ++r) {
    record.motor_N[r] = static_cast<float>(control.rotor_N[r]);
    record.pwm[r] = control.pwm[r];
  }
  record.largest_thrust_gf = static_cast<float>(model.thrust.largest_N(battery_V) / kGramForce_N);
  record.battery_mV = static_cast<std::uint16_t>(std::lround(1000 * battery_V));
  record.prediction_gf = static_cast<float>(control.prediction_N / kGramForce_N);
  return record;
}

}  // namespace swarmcert::stability

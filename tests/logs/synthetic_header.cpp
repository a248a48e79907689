#include "synthetic_header.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>

namespace swarmcert::tests {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180, kDuration_s = 20;

/// sum of a_k sin(w_k t + p_k) with its first two derivatives.
struct Sines {
  std::array<double, 3> value{};
  void add(double t, double size, double rate, double phase) {
    value[0] += size * std::sin(rate * t + phase);
    value[1] += size * rate * std::cos(rate * t + phase);
    value[2] -= size * rate * rate * std::sin(rate * t + phase);
  }
};

/// A smooth rise from 0 to 1 within 2 s, with its first two derivatives.
std::array<double, 3> takeoff(double t) {
  const double s = std::clamp(t / 2, 0.0, 1.0);
  if (s <= 0 || s >= 1) return {s, 0, 0};
  return {s * s * s * (10 - 15 * s + 6 * s * s), 15 * s * s * (1 - s) * (1 - s),
          15 * s * (1 - s) * (1 - 2 * s)};
}

logs::Attitude attitude_of(const logs::Vector& force, double yaw) {
  const double forward = std::cos(yaw) * force[0] + std::sin(yaw) * force[1],
               left = -std::sin(yaw) * force[0] + std::cos(yaw) * force[1];
  const double pitch = std::atan2(forward, force[2]), roll = std::atan2(-left, std::hypot(forward, force[2]));
  const double cr = std::cos(roll / 2), sr = std::sin(roll / 2), cp = std::cos(pitch / 2),
               sp = std::sin(pitch / 2), cy = std::cos(yaw / 2), sy = std::sin(yaw / 2);
  return {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
          cr * cp * cy + sr * sp * sy};
}

/// Flights of a phase above this are calm: a fifth of the motion.
constexpr double kCalm = 5;

FlightState without_rates(double t, double phase) {
  Sines x, y, z;
  x.add(t, 0.5, 1.3, phase), x.add(t, 0.15, 2.9, 2 * phase);
  y.add(t, 0.4, 1.7, 3 * phase), y.add(t, 0.12, 3.3, phase);
  z.add(t, 0.15, 1.1, phase + 1), z.add(t, 0.05, 2.3, phase);
  const std::array<double, 3> up = takeoff(t);
  for (Sines* const axis : {&x, &y, &z})
    for (double& value : axis->value) value *= phase > kCalm ? 0.2 : 1;
  FlightState s;
  for (std::size_t d = 0; d < 3; ++d) {
    // The lateral motion begins with the takeoff: (u w)' = u' w + u w'.
    const auto risen = [&](const Sines& w) {
      return d == 0   ? up[0] * w.value[0]
             : d == 1 ? up[1] * w.value[0] + up[0] * w.value[1]
                      : up[2] * w.value[0] + 2 * up[1] * w.value[1] + up[0] * w.value[2];
    };
    logs::Vector& vector = d == 0 ? s.position_m : d == 1 ? s.velocity_m_s : s.acceleration_m_s2;
    vector = {risen(x), risen(y), 1.2 * up[d] + risen(z)};
  }
  const logs::Vector force = {s.acceleration_m_s2[0], s.acceleration_m_s2[1],
                              s.acceleration_m_s2[2] + logs::kGravity_m_s2};
  s.attitude = attitude_of(force, 0.6 * std::sin(0.5 * t + phase));
  s.specific_force_m_s2 = {0, 0, std::hypot(force[0], force[1], force[2])};
  s.duty = 0.45 * std::sqrt(s.specific_force_m_s2[2] / logs::kGravity_m_s2);
  s.battery_V = 4.1 - 0.01 * t;
  return s;
}

/// One column: its name and its value at a state.
struct Column {
  std::string name;
  std::function<double(const FlightState&)> value;
  double noise = 0, scale = 1;
};

class Scribe {
 public:
  explicit Scribe(std::uint32_t seed) : random_(seed) { table_.phase = 6 * uniform(); }

  SyntheticTable write() {
    is_down_ = chance(0.3);
    is_imu_down_ = is_down_ != chance(0.1);
    has_compass_ = chance(0.15);
    table_.habits = is_down_ ? "NED" : "ENU";
    if (is_imu_down_ != is_down_) table_.habits += ", the IMU otherwise";
    if (table_.phase > kCalm) table_.habits += ", calm";
    add_position();
    if (chance(0.75)) add_velocity();
    if (chance(0.85)) add_attitude();
    if (chance(0.6)) add_specific_force();
    if (chance(0.6)) add_rates();
    if (chance(0.7)) add_motors();
    for (int k = pick(5); k > 0; --k) add_decoy();
    std::shuffle(groups_.begin(), groups_.end(), random_);
    write_text();
    return std::move(table_);
  }

 private:
  double uniform() { return static_cast<double>(random_()) / 4294967296.0; }
  bool chance(double p) { return uniform() < p; }
  int pick(int count) { return static_cast<int>(uniform() * count); }
  std::string one_of(const std::vector<std::string>& words) {
    return words[static_cast<std::size_t>(pick(static_cast<int>(words.size())))];
  }
  double noise(double size) {
    return size * (uniform() + uniform() + uniform() + uniform() - 2) * 1.7;  // nearly normal
  }

  struct Unit {
    std::string name;
    double per_si;
  };
  Unit unit_of(const std::vector<Unit>& units) {
    return chance(0.6) ? units[0] : units[static_cast<std::size_t>(pick(static_cast<int>(units.size())))];
  }
  /// Returns the unit as part of a name, in one of the ways in which people write it.
  std::string suffix(const Unit& unit) {
    // A unit that is not the usual one is stated in most files.
    if (!chance(0.4)) return "";
    std::string words = unit.name;
    if (chance(0.4)) return " (" + words + ")";
    for (const auto& [from, to] : {std::pair<const char*, const char*>{"/s^2", "_s2"}, {"/s", "_s"}}) {
      const std::size_t at = words.find(from);
      if (at != std::string::npos) words.replace(at, std::string(from).size(), to);
    }
    return "_" + words;
  }

  using Of = std::function<const logs::Vector&(const FlightState&)>;
  /// A vector with y and z inverted where the file points down.
  void add_vector(const std::string& what, const std::vector<std::string>& patterns, const Of& of,
                  const std::vector<Unit>& units, double noise_si, bool is_down,
                  const std::string& family = "") {
    const Unit unit = unit_of(units);
    const std::string pattern = family.empty() ? one_of(patterns) : family, after = suffix(unit);
    table_.habits += fmt::format("; {} {}{} in {}", what, pattern, after, unit.name);
    std::vector<Column> group;
    for (std::size_t k = 0; k < 3; ++k) {
      std::string name = pattern;
      const bool is_compass = has_compass_ && pattern.find_first_of("_.") != std::string::npos &&
                              (what == "position" || what == "velocity");
      // x is north of z down, and east of z up.
      name.replace(name.find('#'), 1,
                   is_compass ? std::string(1, (is_down ? "ned" : "enu")[k]) : axis_word(pattern, k));
      const double sign = is_down && k > 0 ? -1 : 1;
      group.push_back({name + after, [of, k, sign](const FlightState& s) { return sign * of(s)[k]; },
                       noise_si, unit.per_si});
    }
    groups_.push_back(std::move(group));
  }
  static std::string axis_word(const std::string& pattern, std::size_t k) {
    const bool is_capital = pattern.find_first_of("PVAG") != std::string::npos;
    return std::string(1, (is_capital ? "XYZ" : "xyz")[k]);
  }

  void add_position() {
    add_vector(
        "position",
        {"#", "p#", "pos_#", "position.#", "Pos#", "drone_#", "est_pos_#", "mocap_#", "p_#", "uav_position_#",
         "state.pos.#", "loc_#"},
        [](const FlightState& s) -> const logs::Vector& { return s.position_m; },
        {{"m", 1}, {"mm", 1000}, {"cm", 100}}, 0.001, is_down_);
  }
  void add_velocity() {
    table_.has_velocity = true;
    add_vector(
        "velocity",
        {"v#", "vel_#", "velocity.#", "Vel#", "drone_vel_#", "est_v#", "lin_vel_#", "v_#", "d#",
         "linear_velocity_#", "speed_#"},
        [](const FlightState& s) -> const logs::Vector& { return s.velocity_m_s; },
        {{"m/s", 1}, {"mm/s", 1000}, {"cm/s", 100}}, 0.01, is_down_);
  }
  void add_specific_force() {
    table_.has_specific_force = true;
    add_vector(
        "accelerometer",
        {"a#", "acc_#", "accel_#", "imu_acc_#", "Acc#", "imu.a#", "accelerometer_#", "imu_accel_#"},
        [](const FlightState& s) -> const logs::Vector& { return s.specific_force_m_s2; },
        {{"m/s^2", 1}, {"g", 1 / logs::kGravity_m_s2}, {"mg", 1000 / logs::kGravity_m_s2}}, 0.1,
        is_imu_down_);
  }
  void add_rates() {
    table_.has_rates = true;
    const Of rates = [](const FlightState& s) -> const logs::Vector& { return s.rates_rad_s; };
    add_vector(
        "rates",
        {"w#", "gyro_#", "omega_#", "imu_gyro_#", "ang_vel_#", "Gyro#", "body_rate_#", "angular_velocity_#"},
        rates, {{"rad/s", 1}, {"deg/s", 1 / kDegree}}, 0.02, is_imu_down_);
  }

  void add_attitude() {
    table_.has_attitude = true;
    if (chance(0.3)) return add_angles();
    const bool is_array = chance(0.3), w_first = chance(0.5);
    const std::string pattern = is_array
                                    ? one_of({"q#", "quat_#", "q[#]", "att_q#"})
                                    : one_of({"q#", "quat_#", "q_#", "orientation.#", "att_q#", "Quat#"});
    table_.habits += fmt::format("; quaternion {} {}", pattern, w_first ? "w first" : "w last");
    std::vector<Column> group;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t part = w_first ? (k + 3) % 4 : k;
      std::string name = pattern;
      name.replace(name.find('#'), 1, is_array ? std::to_string(k) : std::string(1, "xyzw"[part]));
      const double sign = is_down_ && (part == 1 || part == 2) ? -1 : 1;
      group.push_back(
          {name, [part, sign](const FlightState& s) { return sign * s.attitude.xyzw()[part]; }, 5e-4});
    }
    groups_.push_back(std::move(group));
  }
  void add_angles() {
    const bool is_degrees = chance(0.5);
    const std::vector<std::string> words = chance(0.3) ? std::vector<std::string>{"phi", "theta", "psi"}
                                                       : std::vector<std::string>{"roll", "pitch", "yaw"};
    const std::string pattern = one_of({"#", "att_#", "est_#", "euler.#"}),
                      after = suffix({is_degrees ? "deg" : "rad", 1});
    table_.habits += fmt::format("; angles {}{} in {}", pattern, after, is_degrees ? "deg" : "rad");
    std::vector<Column> group;
    for (std::size_t k = 0; k < 3; ++k) {
      std::string name = pattern;
      name.replace(name.find('#'), 1, words[k]);
      const double sign = is_down_ && k > 0 ? -1 : 1;
      group.push_back({name + after,
                       [k, sign](const FlightState& s) {
                         const auto R = s.attitude.rotation();
                         return sign * (k == 0   ? std::atan2(R[2][1], R[2][2])
                                        : k == 1 ? -std::asin(R[2][0])
                                                 : std::atan2(R[1][0], R[0][0]));
                       },
                       1e-3, is_degrees ? 1 / kDegree : 1});
    }
    groups_.push_back(std::move(group));
  }

  void add_motors() {
    table_.has_duty = true;
    const std::string pattern = one_of({"m#", "pwm#", "motor_#", "u#", "motor[#]", "duty_#", "pwm_m#"});
    const double full = chance(0.4) ? 65536 : chance(0.5) ? 100 : 1;
    const int first = pattern.find('[') != std::string::npos || chance(0.3) ? 0 : 1;
    std::vector<Column> group;
    for (int k = 0; k < 4; ++k) {
      std::string name = pattern;
      name.replace(name.find('#'), 1, std::to_string(first + k));
      group.push_back({name, [](const FlightState& s) { return s.duty; }, 0.005, full});
    }
    groups_.push_back(std::move(group));
    groups_.push_back({{one_of({"vbat", "battery", "battery_voltage", "bat_V"}),
                        [](const FlightState& s) { return s.battery_V; }, 0.005, 1}});
    table_.habits += "; motors " + pattern;
  }

  /// Other things than the vehicle's motion.
  void add_decoy() {
    struct Decoy {
      const char* what;
      std::vector<std::string> names;
      std::function<logs::Vector(const FlightState&)> value;
    };
    const double side = 2 * uniform() - 1, phase = 6 * uniform();
    const auto place = [](const FlightState& s) { return s.position_m; };
    const std::vector<Decoy> decoys = {
        {"wind",
         {"wind_vel_#", "wind_#", "wind_v#"},
         [phase](const FlightState& s) -> logs::Vector {
           return {2 + std::sin(9 * s.battery_V * 10 + phase), std::cos(7 * s.battery_V * 10), 0.1};
         }},
        {"payload",
         {"payload_#", "payload_pos_#"},
         [side](const FlightState& s) -> logs::Vector {
           return {s.position_m[0] - 0.1 * s.acceleration_m_s2[0] * side, s.position_m[1],
                   s.position_m[2] - 0.5};
         }},
        {"neighbour",
         {"neighbor_#", "neighbour_pos_#", "leader_#"},
         [side](const FlightState& s) -> logs::Vector {
           return {s.position_m[1] + side, s.position_m[0], 1 + side};
         }},
        {"home",
         {"home_#", "home_pos_#"},
         [](const FlightState&) -> logs::Vector {
           return {0.5, -0.2, 0};
         }},
        {"set point",
         {"ref_#", "des_pos_#", "#_ref", "target_#", "setpoint_#", "traj_#", "pos_sp_#", "sp_#"},
         [place](const FlightState& s) -> logs::Vector {
           logs::Vector ahead = place(s);
           for (std::size_t k = 0; k < 3; ++k) ahead[k] += 0.15 * s.velocity_m_s[k];
           return ahead;
         }},
        {"set point of the velocity",
         {"des_v#", "ref_vel_#", "v#_ref", "cmd_vel_#"},
         [](const FlightState& s) -> logs::Vector {
           logs::Vector ahead = s.velocity_m_s;
           for (std::size_t k = 0; k < 3; ++k) ahead[k] += 0.15 * s.acceleration_m_s2[k];
           return ahead;
         }},
        {"magnetometer",
         {"mag_#", "magn_#"},
         [](const FlightState& s) -> logs::Vector {
           const auto R = s.attitude.rotation();
           return {0.2 * R[0][0], 0.2 * R[0][1], 0.2 * R[0][2] - 0.4};
         }},
        {"second accelerometer",
         {"imu2_acc_#", "imu2_a#"},
         [](const FlightState& s) -> logs::Vector {
           return {0.6, s.specific_force_m_s2[2] * 0.1, 0.95 * s.specific_force_m_s2[2]};
         }},
        {"error", {"pos_err_#", "error_#"}, [](const FlightState& s) -> logs::Vector {
           return {0.1 * s.velocity_m_s[0], 0.1 * s.velocity_m_s[1], 0.1 * s.velocity_m_s[2]};
         }}};
    const Decoy& decoy = decoys[static_cast<std::size_t>(pick(static_cast<int>(decoys.size())))];
    if (table_.habits.find("; " + std::string(decoy.what) + " ") != std::string::npos) return;
    const std::string pattern = one_of(decoy.names);
    table_.habits += fmt::format("; {} {}", decoy.what, pattern);
    std::vector<Column> group;
    for (std::size_t k = 0; k < 3; ++k) {
      std::string name = pattern;
      name.replace(name.find('#'), 1, std::string(1, "xyz"[k]));
      const double sign = is_down_ && k > 0 ? -1 : 1;
      group.push_back(
          {name, [value = decoy.value, k, sign](const FlightState& s) { return sign * value(s)[k]; }, 0.002});
    }
    groups_.push_back(std::move(group));
  }

  void write_text() {
    const std::vector<std::pair<std::string, double>> clocks = {
        {"t", 1},           {"time", 1},           {"timestamp", 1e6}, {"time_ms", 1e3},
        {"Time (s)", 1},    {"timestamp_us", 1e6}, {"t_ns", 1e9},      {"time", 1e3},
        {"timestamp", 1e9}, {"elapsed_s", 1}};
    const auto& [clock, per_s] = clocks[static_cast<std::size_t>(pick(static_cast<int>(clocks.size())))];
    const double step_s = 0.005 * (1 << pick(4));
    table_.text = clock;
    for (const auto& group : groups_)
      for (const Column& column : group) table_.text += "," + column.name;
    for (int k = 0; k * step_s < kDuration_s; ++k) {
      const FlightState state = flight_state(k * step_s, table_.phase);
      table_.text += fmt::format("\n{:.10g}", std::round(k * step_s * per_s * 1000) / 1000);
      for (const auto& group : groups_)
        for (const Column& column : group)
          table_.text += fmt::format(",{:.6g}", column.scale * (column.value(state) + noise(column.noise)));
    }
    table_.text += "\n";
  }

  std::mt19937 random_;
  SyntheticTable table_;
  std::vector<std::vector<Column>> groups_;
  bool is_down_ = false, is_imu_down_ = false, has_compass_ = false;
};

double distance(const logs::Vector& a, const logs::Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

bool is_measured(const logs::Log& log, const std::string& name) {
  return std::any_of(log.sources.begin(), log.sources.end(), [&](const logs::SignalInfo& info) {
    return info.name == name && info.source == logs::SignalInfo::Source::kMeasured;
  });
}

}  // namespace

FlightState flight_state(double time_s, double phase) {
  constexpr double kStep_s = 1e-4;
  FlightState state = without_rates(time_s, phase);
  const logs::Attitude a = without_rates(time_s - kStep_s, phase).attitude,
                       b = without_rates(time_s + kStep_s, phase).attitude;
  // 2 q* dq/dt for a small rotation.
  state.rates_rad_s = {(a.w * b.x - a.x * b.w - a.y * b.z + a.z * b.y) / kStep_s,
                       (a.w * b.y - a.y * b.w - a.z * b.x + a.x * b.z) / kStep_s,
                       (a.w * b.z - a.z * b.w - a.x * b.y + a.y * b.x) / kStep_s};
  return state;
}

SyntheticTable synthetic_table(std::uint32_t seed) { return Scribe(seed).write(); }

Comparison compared(const SyntheticTable& table, const logs::Log& log) {
  struct Error {
    const char* name;
    bool has, is_used;
    double tolerance, squares;
  };
  const bool uses_force = log.signals.specific_force == logs::ForceSource::kAccelerometer;
  std::vector<Error> errors = {
      {"position", true, log.signals.position, 0.05, 0},
      {"velocity", table.has_velocity, is_measured(log, "velocity"), 0.05, 0},
      {"attitude", table.has_attitude, log.signals.attitude, 0.05, 0},
      // Forces are judged where attitude and thrust are known.
      {"specific_force", table.has_specific_force && table.has_attitude && table.has_duty,
       uses_force && log.signals.attitude && log.signals.force, 0.5, 0},
      {"rates", table.has_rates, log.signals.rates, 0.1, 0},
      {"duty", table.has_duty, is_measured(log, "duty"), 0.05, 0}};
  const double start_s = log.samples.empty() ? 0 : 1e-6 * log.samples[0].time_us;
  for (const logs::Sample& sample : log.samples) {
    const FlightState truth = flight_state(1e-6 * sample.time_us - start_s, table.phase);
    const auto R = sample.attitude.rotation(), T = truth.attitude.rotation();
    logs::Vector force{};
    for (std::size_t k = 0; k < 3; ++k) force[k] = T[k][2] * truth.specific_force_m_s2[2];
    double turned = 0;
    for (std::size_t k = 0; k < 3; ++k) turned = std::max(turned, distance(R[k], T[k]));
    const double off[] = {distance(sample.position_m, truth.position_m),
                          distance(sample.velocity_m_s, truth.velocity_m_s),
                          turned,
                          distance(sample.specific_force_m_s2, force),
                          distance(sample.rates_rad_s, truth.rates_rad_s),
                          std::abs(sample.duty[0] - truth.duty)};
    for (std::size_t k = 0; k < errors.size(); ++k) errors[k].squares += off[k] * off[k];
  }
  Comparison result;
  for (const Error& error : errors) {
    const double rms =
        std::sqrt(error.squares / static_cast<double>(std::max<std::size_t>(1, log.samples.size())));
    if (error.is_used && !(rms < error.tolerance))
      result.wrong.push_back(fmt::format("{} by {:.3g}", error.name, rms));
    if (error.has && !error.is_used) result.missing.emplace_back(error.name);
  }
  if (log.samples.size() < 480) result.missing.emplace_back("records");
  return result;
}

}  // namespace swarmcert::tests

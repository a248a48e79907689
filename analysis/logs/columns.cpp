#include <algorithm>
#include <map>
#include <set>

#include "analysis/logs/signals.h"
#include "nn/base/file_io.h"
#include "nn/base/suggest.h"
#include "nn/base/toml.h"

namespace swarmcert::logs {
namespace {

constexpr double kDegree_rad = 3.14159265358979323846 / 180;

/// Columns "<prefix>x<suffix>", "...y...", "...z...".
void add_axes(SignalMap& map, int signal, const std::string& prefix, const std::string& suffix,
              double multiply, double divide) {
  const char* const kAxes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) map.push_back({signal + k, prefix + kAxes[k] + suffix, multiply, divide});
}

SignalMap make_known_columns() {
  SignalMap map = {{kTime, "tick"}, {kTime, "time_us"}, {kTime, "time[ms]"}};
  // the firmware's compressed estimate: mm, mm/s, mm/s^2, mrad/s
  add_axes(map, kPosition, "stateEstimateZ.", "", 1, 1000);
  add_axes(map, kVelocity, "stateEstimateZ.v", "", 1, 1000);
  add_axes(map, kForceWorld, "stateEstimateZ.a", "", 1, 1000);
  map.push_back({kPackedAttitude, "stateEstimateZ.quat"});
  map.push_back({kRates, "stateEstimateZ.rateRoll", 1, 1000});
  map.push_back({kRates + 1, "stateEstimateZ.ratePitch", 1, 1000});
  map.push_back({kRates + 2, "stateEstimateZ.rateYaw", 1, 1000});
  add_axes(map, kTargetPosition, "ctrltargetZ.", "", 1, 1000);
  add_axes(map, kTargetVelocity, "ctrltargetZ.v", "", 1, 1000);
  // the full estimate of newer firmware: m, m/s; accelerations in g, without gravity
  add_axes(map, kPosition, "stateEstimate.", "", 1, 1);
  add_axes(map, kVelocity, "stateEstimate.v", "", 1, 1);
  add_axes(map, kForceBody, "acc.", "", kGravity_m_s2, 1);
  add_axes(map, kAccelerationWorld, "stateEstimate.a", "", kGravity_m_s2, 1);
  add_axes(map, kAttitude, "stateEstimate.q", "", 1, 1);
  map.push_back({kAttitude + 3, "stateEstimate.qw"});
  add_axes(map, kRates, "gyro.", "", kDegree_rad, 1);
  add_axes(map, kTargetPosition, "ctrltarget.", "", 1, 1);
  add_axes(map, kTargetVelocity, "ctrltarget.v", "", 1, 1);
  map.push_back({kBattery, "pm.vbatMV", 1, 1000});
  map.push_back({kBattery, "pm.vbat"});
  map.push_back({kThrust, "motor.thrust"});
  add_axes(map, kTorque, "motor.torque", "", 1, 1);
  for (int k = 0; k < 4; ++k) {
    const std::string number = std::to_string(k + 1);
    map.push_back({kDuty + k, "pwm.m" + number + "_pwm", 1, 65536});
    map.push_back({kDuty + k, "motor.m" + number, 1, 65536});
    map.push_back({kMotorForce + k, "motor.f" + number});
    map.push_back({kDuty + k, "u" + number + "[PWM]"});
    map.push_back({kMotorForce + k, "u" + number + "[N]"});
  }
  // the authors' CSV
  add_axes(map, kPosition, "", "[m]", 1, 1);
  add_axes(map, kVelocity, "v", "[m/s]", 1, 1);
  add_axes(map, kForceWorld, "a", "[m/s^2]", 1, 1);
  add_axes(map, kAttitude, "q", "", 1, 1);
  map.push_back({kAttitude + 3, "qw"});
  add_axes(map, kRates, "w", "[rad/s]", 1, 1);
  map.push_back({kBattery, "Vbat[V]"});
  map.push_back({kThrust, "thrust_des[g]", kGravity_m_s2, 1000});
  add_axes(map, kTorque, "torque", "[Nm]", 1, 1);
  return map;
}

struct Unit {
  const char* name;
  double multiply, divide;
};

/// What a columns.toml may name.
struct NamedSignal {
  int signal;
  std::vector<Unit> units;
  bool may_be_body = false;
};

std::map<std::string, NamedSignal> named_signals() {
  std::map<std::string, NamedSignal> named;
  const auto add = [&](const std::string& name, const std::vector<std::string>& parts, int first,
                       const std::vector<Unit>& units, bool may_be_body = false) {
    for (std::size_t k = 0; k < parts.size(); ++k)
      named[name + parts[k]] = {first + static_cast<int>(k), units, may_be_body};
  };
  const std::vector<std::string> axes = {"_x", "_y", "_z"}, motors = {"_1", "_2", "_3", "_4"};
  const std::vector<Unit> length = {{"m", 1, 1}, {"mm", 1, 1000}};
  const std::vector<Unit> speed = {{"m/s", 1, 1}, {"mm/s", 1, 1000}};
  const std::vector<Unit> force = {{"N", 1, 1}, {"gf", kGravity_m_s2, 1000}};
  add("time", {""}, kTime, {{"s", 1e6, 1}, {"ms", 1e3, 1}, {"us", 1, 1}});
  add("position", axes, kPosition, length);
  add("velocity", axes, kVelocity, speed);
  add("specific_force", axes, kForceWorld, {{"m/s^2", 1, 1}, {"mm/s^2", 1, 1000}, {"g", kGravity_m_s2, 1}},
      true);
  add("attitude", {"_x", "_y", "_z", "_w"}, kAttitude, {{"1", 1, 1}});
  add("rate", axes, kRates, {{"rad/s", 1, 1}, {"mrad/s", 1, 1000}, {"deg/s", kDegree_rad, 1}});
  add("duty", motors, kDuty, {{"1", 1, 1}, {"PWM", 1, 65536}});
  add("battery", {""}, kBattery, {{"V", 1, 1}, {"mV", 1, 1000}});
  add("target_position", axes, kTargetPosition, length);
  add("target_velocity", axes, kTargetVelocity, speed);
  add("motor_force", motors, kMotorForce, force);
  add("thrust_command", {""}, kThrust, force);
  add("torque_command", axes, kTorque, {{"Nm", 1, 1}});
  return named;
}

}  // namespace

const SignalMap& known_columns() {
  static const SignalMap map = make_known_columns();
  return map;
}

SignalMap parse_columns(const std::string& text, const std::string& path) {
  const toml::table document = files::parse_toml(text, path);
  const files::TomlTable root(document, path);
  root.choice("schema", {"swarmcert/columns/1"});
  const std::map<std::string, NamedSignal> named = named_signals();
  std::vector<std::string> known = {"schema"};
  for (const auto& [name, unused] : named) known.push_back(name);
  root.allow_only(known);
  SignalMap map;
  std::set<bool> frames;  // of the specific force: true where it is the body's
  for (const std::string& name : root.keys()) {
    if (name == "schema") continue;
    const files::TomlTable table = root.table(name);
    table.allow_only({"column", "unit", "frame"});
    const NamedSignal& signal = named.at(name);
    std::vector<std::string> units;
    for (const Unit& unit : signal.units) units.emplace_back(unit.name);
    const Unit& unit = signal.units[table.choice("unit", units)];
    bool in_body = false;
    if (table.has("frame")) {
      const bool is_body_signal = signal.signal >= kRates && signal.signal < kDuty;
      std::vector<std::string> allowed = {is_body_signal ? "body" : "world"};
      if (signal.may_be_body) allowed.emplace_back("body");
      in_body = table.choice("frame", allowed) == 1;
    }
    if (signal.may_be_body) {
      frames.insert(in_body);
      if (frames.size() == 2)
        table.refuse("frame", "", "differs from the frame of another axis", "all three axes need one frame");
    }
    map.push_back({in_body ? signal.signal - kForceWorld + kForceBody : signal.signal, table.text("column"),
                   unit.multiply, unit.divide, true});
  }
  return map;
}

SignalMap read_columns(const std::string& path) { return parse_columns(files::read_file(path), path); }

}  // namespace swarmcert::logs

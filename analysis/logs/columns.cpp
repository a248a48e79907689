#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/logs/angles.h"
#include "analysis/logs/signals.h"
#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/suggest.h"
#include "nn/base/toml.h"

namespace swarmcert::logs {
namespace {

constexpr const char* kColumnsSchema = "swarmcert/columns/1";

struct Unit {
  const char* name;
  double multiply, divide, offset = 0;
};

/// A signal that columns.toml may name.
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
  // A minus in the unit marks columns of opposite sign, as in frames whose z axis points down.
  const auto of_both_signs = [&](std::vector<Unit> units) {
    static const std::map<std::string, const char*> negative = {
        {"1", "-1"},           {"m", "-m"},         {"mm", "-mm"},         {"m/s", "-m/s"},
        {"cm", "-cm"},         {"mm/s", "-mm/s"},   {"cm/s", "-cm/s"},     {"m/s^2", "-m/s^2"},
        {"mm/s^2", "-mm/s^2"}, {"g", "-g"},         {"mg", "-mg"},         {"rad", "-rad"},
        {"deg", "-deg"},       {"rad/s", "-rad/s"}, {"mrad/s", "-mrad/s"}, {"deg/s", "-deg/s"}};
    const std::size_t count = units.size();
    for (std::size_t i = 0; i < count; ++i)
      units.push_back({negative.at(units[i].name), -units[i].multiply, units[i].divide});
    return units;
  };
  const std::vector<Unit> length = of_both_signs({{"m", 1, 1}, {"cm", 1, 100}, {"mm", 1, 1000}});
  const std::vector<Unit> speed = of_both_signs({{"m/s", 1, 1}, {"cm/s", 1, 100}, {"mm/s", 1, 1000}});
  const std::vector<Unit> force = {{"N", 1, 1}, {"gf", kGravity_m_s2, 1000}};
  add("time", {""}, kTime, {{"s", 1e6, 1}, {"ms", 1e3, 1}, {"us", 1, 1}, {"ns", 1, 1000}});
  add("position", axes, kPosition, length);
  add("velocity", axes, kVelocity, speed);
  add("specific_force", axes, kForceWorld,
      of_both_signs(
          {{"m/s^2", 1, 1}, {"mm/s^2", 1, 1000}, {"g", kGravity_m_s2, 1}, {"mg", kGravity_m_s2, 1000}}),
      true);
  add("attitude", {"_x", "_y", "_z", "_w"}, kAttitude, of_both_signs({{"1", 1, 1}}));
  // Angles of R = Rz(yaw) Ry(pitch) Rx(roll).
  const std::vector<Unit> angle = of_both_signs({{"rad", 1, 1}, {"deg", kDegree_rad, 1}});
  add("roll", {""}, kEuler, angle);
  add("pitch", {""}, kEuler + 1, angle);
  add("yaw", {""}, kEuler + 2, angle);
  add("attitude_packed", {""}, kPackedAttitude, {{"packed", 1, 1}});
  const std::vector<Unit> share = {
      {"1", 1, 1}, {"%", 1, 100}, {"permille", 1, 1000}, {"1/255", 1, 255}, {"PWM", 1, 65536}};
  add("requested", motors, kRequested, share);
  add("rate", axes, kRates, of_both_signs({{"rad/s", 1, 1}, {"mrad/s", 1, 1000}, {"deg/s", kDegree_rad, 1}}));
  add("duty", motors, kDuty, share);
  add("rotor_speed", motors, kRotorSpeed, {{"rad/s", 1, 1}, {"rpm", 2 * kPi, 60}, {"erpm", 2 * kPi, 60 * 6}});
  add("motor_command", {"_1", "_2", "_3", "_4", "_5", "_6", "_7", "_8"}, kMotorCommand,
      {{"1", 1, 1}, {"%", 1, 100}, {"permille", 1, 1000}, {"PWM", 1, 65536}, {"us", 1, 1000, 1000}});
  add("battery", {""}, kBattery, {{"V", 1, 1}, {"mV", 1, 1000}});
  add("target_position", axes, kTargetPosition, length);
  add("target_velocity", axes, kTargetVelocity, speed);
  add("motor_force", motors, kMotorForce, force);
  add("thrust_command", {""}, kThrust, force);
  add("thrust_command_normalised", {""}, kThrustCommand, {{"1", 1, 1}});
  add("torque_command", axes, kTorque, {{"N m", 1, 1}, {"Nm", 1, 1}});
  return named;
}

}  // namespace

namespace {

/// Returns name and units; nullptr if columns.toml does not know the signal. Forces in B and accelerations are as
/// forces in W.
const std::pair<const std::string, NamedSignal>* named_signal(int signal) {
  static const std::map<std::string, NamedSignal> named = named_signals();
  const int alike =
      signal >= kForceBody && signal < kAttitude ? kForceWorld + (signal - kForceWorld) % 3 : signal;
  for (const auto& entry : named)
    if (entry.second.signal == alike) return &entry;
  return nullptr;
}

}  // namespace

std::optional<UnitFactor> unit_factor(int signal, const std::string& unit) {
  const auto* const named = named_signal(signal);
  if (named == nullptr) return std::nullopt;
  for (const Unit& candidate : named->second.units)
    if (unit == candidate.name) return UnitFactor{candidate.multiply, candidate.divide, candidate.offset};
  return std::nullopt;
}

std::string columns_name(int signal) {
  const auto* const named = named_signal(signal);
  return named == nullptr ? "" : named->first;
}

std::string unit_of_factor(int signal, double factor, double offset) {
  const auto* const named = named_signal(signal);
  if (named == nullptr) return "";
  for (const Unit& unit : named->second.units)
    if (std::abs(unit.multiply / unit.divide / factor - 1) < 1e-9 && unit.offset == offset) return unit.name;
  return "";
}

bool is_same_meaning(const SignalMap& a, const SignalMap& b) {
  const auto is_in_b = [&](const SignalSource& one) {
    return std::any_of(b.begin(), b.end(), [&](const SignalSource& other) {
      return one.signal == other.signal && one.column == other.column && one.offset == other.offset &&
             std::abs(one.multiply * other.divide / (other.multiply * one.divide) - 1) < 1e-9;
    });
  };
  return a.size() == b.size() && std::all_of(a.begin(), a.end(), is_in_b);
}

const SignalMap& known_columns() {
  static const SignalMap map;
  return map;
}

namespace {

/// The frames that a signal may state; several for the specific force.
std::vector<std::string> frames_of(const NamedSignal& signal) {
  const bool is_body_signal = signal.signal >= kRates && signal.signal < kDuty;
  if (is_body_signal) return {"body"};
  if (signal.may_be_body) return {"world", "body"};
  return {"world"};
}

std::vector<std::string> units_of(const NamedSignal& signal) {
  std::vector<std::string> units;
  for (const Unit& unit : signal.units) units.emplace_back(unit.name);
  return units;
}

void describe_column(files::Keys& keys, const NamedSignal& signal) {
  keys.must<std::string>("column", "Its name in the header of the file.");
  keys.must("unit", "Of its values; a minus: of opposite sign.", "", files::OneOf{units_of(signal)});
  keys.may("frame", "Of its values.", "", files::OneOf{frames_of(signal)});
}

}  // namespace

void describe_columns_file(files::Keys& keys) {
  keys.schema(kColumnsSchema);
  for (const auto& [name, signal] : named_signals())
    keys.may_table(name, "The column that is this signal.",
                   [&one = signal](files::Keys& column) { describe_column(column, one); });
}

SignalMap parse_columns(const std::string& text, const std::string& path) {
  const toml::table document = files::parse_toml(text, path);
  const files::TomlTable root(document, path);
  root.choice("schema", {kColumnsSchema});
  root.allow_only(files::key_names(describe_columns_file));
  const std::map<std::string, NamedSignal> named = named_signals();
  SignalMap map;
  std::set<bool> frames;  // of the specific force: true for the body frame
  for (const std::string& name : root.keys()) {
    if (name == "schema") continue;
    const files::TomlTable table = root.table(name);
    const NamedSignal& signal = named.at(name);
    table.allow_only(files::key_names([&](files::Keys& keys) { describe_column(keys, signal); }));
    const Unit& unit = signal.units[table.choice("unit", units_of(signal))];
    const bool in_body = table.has("frame") && table.choice("frame", frames_of(signal)) == 1;
    if (signal.may_be_body) {
      frames.insert(in_body);
      if (frames.size() == 2)
        table.refuse("frame", "", "differs from the frame of another axis", "all three axes need one frame");
    }
    map.push_back({in_body ? signal.signal - kForceWorld + kForceBody : signal.signal, table.text("column"),
                   unit.multiply, unit.divide, unit.name, unit.offset});
  }
  return map;
}

SignalMap read_columns(const std::string& path) { return parse_columns(files::read_file(path), path); }

}  // namespace swarmcert::logs

#include "analysis/logs/column_names.h"

#include <cctype>
#include <map>

#include "analysis/logs/angles.h"
#include "nn/base/pi.h"

namespace swarmcert::logs {
namespace {

/// Returns `pattern` with '#' replaced by each of `words`.
std::vector<std::string> each(const std::string& pattern, const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const std::string& word : words) {
    std::string name = pattern;
    const std::size_t at = name.find('#');
    names.push_back(at == std::string::npos ? name : name.replace(at, 1, word));
  }
  return names;
}

std::vector<std::string> axes(const std::string& pattern) { return each(pattern, {"x", "y", "z"}); }
std::vector<std::string> rotors(const std::string& pattern) { return each(pattern, {"1", "2", "3", "4"}); }
std::vector<std::string> quaternion(const std::string& pattern) {
  return each(pattern, {"x", "y", "z", "w"});
}
std::vector<std::string> euler(const std::string& pattern) { return each(pattern, {"roll", "pitch", "yaw"}); }

using Table = std::vector<NamedColumns>;

/// The names of columns.toml, in SI units, as produced by message_frames.h.
void add_own(Table& t) {
  t.push_back({kPosition, axes("position.#"), "m"});
  t.push_back({kVelocity, axes("velocity.#"), "m/s"});
  t.push_back({kForceBody, axes("specific.force.body.#"), "m/s^2"});
  t.push_back({kAttitude, quaternion("attitude.#"), "1"});
  t.push_back({kEuler, axes("euler.#"), "rad"});
  t.push_back({kRates, axes("rate.#"), "rad/s"});
  t.push_back({kBattery, {"battery.volt"}, "V"});
  t.push_back({kTargetPosition, axes("target.position.#"), "m"});
  t.push_back({kTargetVelocity, axes("target.velocity.#"), "m/s"});
  for (int motors = 8; motors >= 3; --motors) {
    std::vector<std::string> names;
    for (int k = 1; k <= motors; ++k) names.push_back("motor.command." + std::to_string(k));
    t.push_back({kMotorCommand, names, "1"});
  }
  t.push_back({kThrustCommand, {"thrust.command.normalised"}, "1"});
}

/// The CSV files of the published flights. Their "a" is a specific force in the world frame.
void add_published(Table& t) {
  t.push_back({kPosition, axes("#[m]"), "m"});
  t.push_back({kVelocity, axes("v#[m/s]"), "m/s"});
  t.push_back({kForceWorld, axes("a#[m/s^2]"), "m/s^2"});
  t.push_back({kRates, axes("w#[rad/s]"), "rad/s"});
  t.push_back({kDuty, rotors("u#[PWM]"), "1"});
  t.push_back({kMotorForce, rotors("u#[N]"), "N"});
  t.push_back({kBattery, {"Vbat[V]"}, "V"});
  t.push_back({kThrust, {"thrust_des[g]"}, "gf", kGravity_m_s2, 1000});
  t.push_back({kTorque, axes("torque#[Nm]"), "N m"});
}

/// Log variables of the Crazyflie firmware.
void add_crazyflie(Table& t) {
  t.push_back({kPosition, axes("stateestimatez.#"), "mm", 1, 1000});
  t.push_back({kPosition, axes("stateestimate.#"), "m"});
  t.push_back({kPosition, axes("kalman.state#"), "m"});
  t.push_back({kPosition, axes("locsrv.#"), "m"});
  t.push_back({kPosition, axes("locsrvz.#"), "mm", 1, 1000});
  t.push_back({kPosition, axes("extpos.#"), "m"});
  t.push_back({kVelocity, axes("stateestimatez.v#"), "mm/s", 1, 1000});
  t.push_back({kVelocity, axes("stateestimate.v#"), "m/s"});
  // kalman.stateP* is a velocity in the body frame, so for kalman.state* the velocity is derived from the position.
  t.push_back({kForceWorld, axes("stateestimatez.a#"), "mm/s^2", 1, 1000});
  t.push_back({kAttitude, quaternion("stateestimate.q#"), "1"});
  t.push_back({kPackedAttitude, {"stateestimatez.quat"}, "packed"});
  t.push_back({kAttitude, each("kalman.q#", {"1", "2", "3", "0"}), "1"});
  t.push_back({kAttitude, quaternion("locsrv.q#"), "1"});
  t.push_back({kEuler, axes("ctrllee.rpy#"), "rad"});
  // The firmware's legacy convention: degrees, and positive pitch raises the nose.
  for (const char* group : {"stateestimate.#", "stabilizer.#"})
    t.push_back(
        {kEuler, euler(group), "deg", kDegree_rad, 1, Ask::kNothing, Origin::kPrograms, {1, -1, 1, 1}});
  t.push_back({kRates, each("stateestimatez.rate#", {"roll", "pitch", "yaw"}), "mrad/s", 1, 1000});
  t.push_back({kRates, axes("ctrllee.omega#"), "rad/s"});
  t.push_back({kRates,
               each("ctrlmel.r.#", {"roll", "pitch", "yaw"}),
               "rad/s",
               1,
               1,
               Ask::kNothing,
               Origin::kPrograms,
               {1, -1, 1, 1}});
  t.push_back({kDuty, rotors("pwm.m#.pwm"), "1/65536", 1, 65536});
  // The request before battery compensation; since November 2022 the duty after it, without an upper limit.
  t.push_back({kRequested, rotors("motor.m#req"), "1/65536", 1, 65536, Ask::kMotors});
  t.push_back({kRequested, rotors("motor.m#"), "1/65536", 1, 65536, Ask::kMotors});
  t.push_back({kBattery, {"pm.vbatmv"}, "mV", 1, 1000});
  t.push_back({kBattery, {"pm.vbat"}, "V"});
  t.push_back({kTargetPosition, axes("ctrltargetz.#"), "mm", 1, 1000});
  t.push_back({kTargetPosition, axes("ctrltarget.#"), "m"});
  t.push_back({kTargetVelocity, axes("ctrltargetz.v#"), "mm/s", 1, 1000});
  t.push_back({kTargetVelocity, axes("ctrltarget.v#"), "m/s"});
  t.push_back({kMotorForce, rotors("motor.f#"), "N"});
  t.push_back({kThrust, {"motor.thrust"}, "N"});
  t.push_back({kThrust, {"ctrllee.thrustsi"}, "N"});
  t.push_back({kThrust, {"ctrlmel.thrustsi"}, "N"});
  t.push_back({kTorque, axes("motor.torque#"), "N m"});
  t.push_back({kTorque, axes("ctrllee.torque#"), "N m"});
  for (const char* name : {"ctrlmel.cmd.thrust", "controller.cmd.thrust", "controller.actuatorthrust",
                           "ctrllee.thrust", "stabilizer.thrust"})
    t.push_back({kThrustCommand, {name}, "1"});
  // Accelerations of the estimate come last, because they are derivatives filtered by the estimator.
  t.push_back({kAccelerationWorld, axes("stateestimate.a#"), "g", kGravity_m_s2, 1});
}

/// Log variables of the Crazyflie firmware that other programs use too.
void add_common_words(Table& t) {
  t.push_back({kForceBody, axes("acc.#"), "g", kGravity_m_s2, 1});
  t.push_back({kRates, axes("gyro.#"), "deg/s", kDegree_rad, 1});
  t.push_back({kPosition, axes("ext.pos.#"), "m"});
}

/// Fields of ROS messages.
void add_messages(Table& t) {
  for (const char* group : {"pose.position.#", "pose.pose.position.#", "odom.position.#",
                            "transform.translation.#", "point.#", "position.#"})
    t.push_back({kPosition, axes(group), "m"});
  t.push_back({kVelocity, axes("velocity.#"), "m/s"});
  t.push_back({kForceBody, axes("linear.acceleration.#"), "m/s^2"});
  for (const char* group :
       {"pose.orientation.#", "pose.pose.orientation.#", "transform.rotation.#", "orientation.#"})
    t.push_back({kAttitude, quaternion(group), "1"});
  for (const char* group : {"angular.velocity.#", "twist.angular.#", "twist.twist.angular.#"})
    t.push_back({kRates, axes(group), "rad/s"});
  t.push_back({kBattery, {"voltage"}, "V"});
}

/// Rotor speeds, collective commands, and velocities in a frame that only the motion tells.
void add_stated(Table& t) {
  for (const char* group : {"twist.twist.linear.#", "twist.linear.#"})
    t.push_back({kVelocity, axes(group), "m/s", 1, 1, Ask::kVelocityFrame});
  for (const char* group :
       {"rpm#", "rpm.#", "rpm.m#", "motor.rpm.#", "rotor.speed.#", "motor.speed.#", "omega.m#"})
    t.push_back({kRotorSpeed, rotors(group), "rpm", 2 * kPi, 60});
  for (const char* group : {"m#.rads", "m#.rad.s", "motor#.rad.s", "rotor.speed.#.rad.s"})
    t.push_back({kRotorSpeed, rotors(group), "rad/s"});
  // Electrical revolutions per minute: the brushless motors of a Crazyflie have six pole pairs.
  for (const char* group : {"m#.erpm", "erpm.m#", "erpm#", "erpm.#", "motor#.erpm"})
    t.push_back({kRotorSpeed, rotors(group), "erpm", 2 * kPi, 60 * 6});
  for (const char* name : {"thrust", "thrust.cmd", "cmd.thrust", "collective.thrust", "thrust.setpoint"})
    t.push_back({kThrustCommand, {name}, "1"});
}

void add_rows(Table& table, void (*add)(Table&), Origin origin) {
  const std::size_t first = table.size();
  add(table);
  for (std::size_t i = first; i < table.size(); ++i) table[i].origin = origin;
}

Table make_table() {
  Table table;
  add_rows(table, add_own, Origin::kOwn);
  add_rows(table, add_published, Origin::kPrograms);
  add_rows(table, add_crazyflie, Origin::kPrograms);
  add_rows(table, add_common_words, Origin::kCommonWords);
  add_rows(table, add_messages, Origin::kMessages);
  add_rows(table, add_stated, Origin::kUnits);
  return table;
}

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

}  // namespace

const std::vector<NamedColumns>& column_names() {
  static const Table table = make_table();
  return table;
}

std::string plain_name(const std::string& column) {
  std::string plain;
  bool in_word = false;
  for (const char c : column.substr(0, column.find_first_of("[(", 1))) {
    if (is_word(c)) {
      if (!in_word && !plain.empty()) plain += '.';
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    in_word = is_word(c);
  }
  // Array elements keep their index: q[0] becomes "q.0".
  const std::size_t bracket = column.find('[', 1);
  if (bracket != std::string::npos && bracket + 1 < column.size() &&
      std::isdigit(static_cast<unsigned char>(column[bracket + 1])) != 0)
    plain += "." + plain_name(column.substr(bracket + 1));
  return plain;
}

StatedUnit stated_unit(const std::string& column) {
  static const std::map<std::string, const char*> spelled = {
      {"m", "m"},         {"mm", "mm"},      {"cm", "cm"},         {"m.s", "m/s"},       {"mps", "m/s"},
      {"mm.s", "mm/s"},   {"mmps", "mm/s"},  {"cm.s", "cm/s"},     {"cmps", "cm/s"},     {"m.s2", "m/s^2"},
      {"m.s.2", "m/s^2"}, {"mps2", "m/s^2"}, {"mm.s2", "mm/s^2"},  {"mm.s.2", "mm/s^2"}, {"g", "g"},
      {"mg", "mg"},       {"rad", "rad"},    {"deg", "deg"},       {"degrees", "deg"},   {"rad.s", "rad/s"},
      {"radps", "rad/s"}, {"rads", "rad/s"}, {"mrad.s", "mrad/s"}, {"deg.s", "deg/s"},   {"degps", "deg/s"},
      {"dps", "deg/s"},   {"v", "V"},        {"volt", "V"},        {"volts", "V"},       {"mv", "mV"},
      {"pct", "%"},       {"percent", "%"},  {"pwm", "PWM"}};
  const std::string plain = plain_name(column);
  const std::size_t open = column.find_last_of("[("), close = column.find_last_of("])");
  if (open != std::string::npos && close != std::string::npos && close > open) {
    const std::string inside = column.substr(open + 1, close - open - 1);
    const auto known = spelled.find(plain_name(inside));
    return {known != spelled.end() ? known->second : inside == "%" ? "%" : "", plain};
  }
  // The longest unit first: "vx.mm.s" is in mm/s. A name must remain before it.
  for (std::size_t dot = plain.find('.'); dot != std::string::npos; dot = plain.find('.', dot + 1)) {
    const auto known = spelled.find(plain.substr(dot + 1));
    if (known != spelled.end()) return {known->second, plain.substr(0, dot)};
  }
  return {"", plain};
}

std::vector<std::string> called_names(const std::string& column) {
  std::vector<std::string> names = {column};
  const std::size_t dot = column.find('.');
  if (dot == std::string::npos || column.find('.', dot + 1) == std::string::npos) return names;
  names.push_back(column.substr(dot + 1));
  return names;
}

}  // namespace swarmcert::logs

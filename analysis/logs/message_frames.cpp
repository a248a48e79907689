#include "analysis/logs/message_frames.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "analysis/logs/angles.h"

namespace swarmcert::logs {
namespace {

/// Returns "vehicle_local_position" for a topic of that name or of the type px4_msgs/msg/VehicleLocalPosition.
std::string message_of(const RawTopic& topic) {
  const std::size_t slash = topic.type.rfind('/');
  if (topic.type.rfind("px4_msgs", 0) != 0 || slash == std::string::npos) return topic.name;
  std::string name;
  for (const char c : topic.type.substr(slash + 1)) {
    if (std::isupper(static_cast<unsigned char>(c)) != 0 && !name.empty()) name += '_';
    name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return name;
}

/// Copies columns of a topic under other names.
class Renamer {
 public:
  explicit Renamer(RawTopic& topic) : topic_(topic) {}

  /// Returns false if the topic has no column `from`.
  bool add(const std::string& from, const std::string& to, double factor) {
    const RawColumn* const column = topic_.find(from);
    if (column == nullptr || topic_.find(to) != nullptr) return false;
    RawColumn copy{to, "", column->values};
    for (double& value : copy.values) value *= factor;
    topic_.columns.push_back(std::move(copy));
    return true;
  }

  /// Adds the first of `patterns` ('#' stands for an axis) for which all three columns exist, as (x, -y, -z).
  void add_vector(const std::vector<std::string>& patterns, const std::vector<std::string>& axes,
                  const std::string& to, double factor = 1) {
    const char* const kAxes[] = {"_x", "_y", "_z"};
    for (const std::string& pattern : patterns) {
      bool all = true;
      for (std::size_t k = 0; k < 3 && all; ++k) all = topic_.find(filled(pattern, axes[k])) != nullptr;
      for (std::size_t k = 0; k < 3 && all; ++k)
        add(filled(pattern, axes[k]), to + kAxes[k], k == 0 ? factor : -factor);
      if (all) return;
    }
  }

  static std::string filled(const std::string& pattern, const std::string& word) {
    std::string name = pattern;
    return name.replace(name.find('#'), 1, word);
  }

 private:
  RawTopic& topic_;
};

const std::vector<std::string> kXyz = {"x", "y", "z"}, kIndex = {"0", "1", "2"};

void add_quaternion(RawTopic& topic) {
  Renamer renamer(topic);
  renamer.add("q[1]", "attitude_x", 1);
  renamer.add("q[2]", "attitude_y", -1);
  renamer.add("q[3]", "attitude_z", -1);
  renamer.add("q[0]", "attitude_w", 1);
}

/// Adds motor commands from columns of servo signals in microseconds: the consecutive outputs in use, from the first
/// on. Values below about 900 mean that the output is off.
void add_servo_outputs(RawTopic& topic, const std::string& pattern, int first) {
  int motor = 0;
  for (int k = first; k < first + 8; ++k) {
    const RawColumn* const column = topic.find(Renamer::filled(pattern, std::to_string(k)));
    if (column == nullptr || column->values.empty()) break;
    const auto [low, high] = std::minmax_element(column->values.begin(), column->values.end());
    if (!(*high >= 900) || !(*high <= 2500) || *high == *low) break;
    RawColumn command{"motor_command_" + std::to_string(++motor), "", column->values};
    for (double& value : command.values) value = std::min(std::max((value - 1000) / 1000, 0.0), 1.0);
    topic.columns.push_back(std::move(command));
  }
}

/// Returns ArduPilot's output of each motor (SERVOn_FUNCTION 33 to 40 is motor 1 to 8); empty if the parameters assign
/// fewer than three motors.
std::vector<int> outputs_of_motors(const std::map<std::string, double>& parameters) {
  constexpr int kFirstMotor = 33, kMost = 8, kOutputs = 16;
  std::vector<int> outputs(kMost, 0);
  for (int n = 1; n <= kOutputs; ++n) {
    const auto found = parameters.find("SERVO" + std::to_string(n) + "_FUNCTION");
    if (found == parameters.end()) continue;
    const double motor = found->second - kFirstMotor;
    if (motor >= 0 && motor < kMost) outputs[static_cast<std::size_t>(motor)] = n;
  }
  outputs.erase(std::find(outputs.begin(), outputs.end(), 0), outputs.end());
  return outputs.size() < 3 ? std::vector<int>() : outputs;
}

/// Scales outputs to motor commands by MOT_PWM_MIN and MOT_PWM_MAX; 1000 and 2000 us if these are not set.
void add_ardupilot_outputs(RawTopic& topic, const std::map<std::string, double>& parameters) {
  const std::vector<int> outputs = outputs_of_motors(parameters);
  for (const int output : outputs) {
    if (topic.find("C" + std::to_string(output)) == nullptr) return;  // it is in RCO2, with separate times
  }
  if (outputs.empty()) return add_servo_outputs(topic, "C#", 1);
  const auto limit_us = [&](const char* name, double otherwise) {
    const auto found = parameters.find(name);
    return found != parameters.end() && found->second > 0 ? found->second : otherwise;
  };
  double low_us = limit_us("MOT_PWM_MIN", 1000), high_us = limit_us("MOT_PWM_MAX", 2000);
  if (!(high_us > low_us)) low_us = 1000, high_us = 2000;
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const RawColumn& column = *topic.find("C" + std::to_string(outputs[k]));
    RawColumn command{"motor_command_" + std::to_string(k + 1), "", column.values};
    for (double& value : command.values)
      value = std::min(std::max((value - low_us) / (high_us - low_us), 0.0), 1.0);
    topic.columns.push_back(std::move(command));
  }
}

/// Adds normalised motor commands; NaN for unused motors.
void add_motors(RawTopic& topic) {
  for (int k = 0; k < 8; ++k) {
    const RawColumn* const column = topic.find("control[" + std::to_string(k) + "]");
    if (column == nullptr) return;
    const bool used =
        std::any_of(column->values.begin(), column->values.end(), [](double x) { return std::isfinite(x); });
    if (!used) return;
    RawColumn command{"motor_command_" + std::to_string(k + 1), "", column->values};
    for (double& value : command.values) value = std::isfinite(value) ? std::max(value, 0.0) : 0;  // disarmed
    topic.columns.push_back(std::move(command));
  }
}

/// Removes the columns that the estimator never marks as valid, and notes them.
void remove_invalid(RawTopic& topic, std::vector<std::string>& notes) {
  static const std::vector<std::pair<std::string, std::vector<std::string>>> flags = {
      {"xy_valid", {"x", "y"}}, {"z_valid", {"z"}}, {"v_xy_valid", {"vx", "vy"}}, {"v_z_valid", {"vz"}}};
  for (const auto& [flag, columns] : flags) {
    const RawColumn* const valid = topic.find(flag);
    if (valid == nullptr ||
        std::any_of(valid->values.begin(), valid->values.end(), [](double x) { return x != 0; }))
      continue;
    for (RawColumn& column : topic.columns) {
      if (std::find(columns.begin(), columns.end(), column.name) == columns.end()) continue;
      column.values.assign(column.values.size(), NAN);
      notes.push_back("not used: " + topic.name + ": " + column.name + ": the estimator says " + flag +
                      " = 0");
    }
  }
}

void add_px4(RawTopic& topic, const std::string& message, std::vector<std::string>& notes) {
  Renamer renamer(topic);
  if (message == "vehicle_local_position") {
    remove_invalid(topic, notes);
    renamer.add_vector({"#"}, kXyz, "position");
    renamer.add_vector({"v#"}, kXyz, "velocity");
  } else if (message == "vehicle_attitude") {
    add_quaternion(topic);
    renamer.add_vector({"#speed"}, {"roll", "pitch", "yaw"}, "rate");
  } else if (message == "vehicle_angular_velocity") {
    renamer.add_vector({"xyz[#]"}, kIndex, "rate");
  } else if (message == "vehicle_acceleration") {
    renamer.add_vector({"xyz[#]"}, kIndex, "specific_force_body");
  } else if (message == "sensor_combined") {
    renamer.add_vector({"accelerometer_m_s2[#]"}, kIndex, "specific_force_body");
    renamer.add_vector({"gyro_rad[#]"}, kIndex, "rate");
  } else if (message == "battery_status") {
    if (!renamer.add("voltage_v", "battery_volt", 1)) renamer.add("voltage_filtered_v", "battery_volt", 1);
  } else if (message == "actuator_motors") {
    add_motors(topic);
  } else if (message == "actuator_outputs") {
    add_servo_outputs(topic, "output[#]", 0);
  } else if (message == "vehicle_thrust_setpoint") {
    renamer.add("xyz[2]", "thrust_command_normalised", -1);
  } else if (message == "actuator_controls_0") {
    renamer.add("control[3]", "thrust_command_normalised", 1);
  } else if (message == "vehicle_local_position_setpoint" || message == "trajectory_setpoint") {
    renamer.add_vector({"position[#]"}, kIndex, "target_position");
    renamer.add_vector({"#"}, kXyz, "target_position");
    renamer.add_vector({"velocity[#]"}, kIndex, "target_velocity");
    renamer.add_vector({"v#"}, kXyz, "target_velocity");
  }
}

void add_ardupilot(RawTopic& topic, const std::map<std::string, double>& parameters) {
  Renamer renamer(topic);
  const std::string& message = topic.name;
  const std::vector<std::string> ned = {"N", "E", "D"}, capital = {"X", "Y", "Z"};
  if (message == "XKF1" || message == "NKF1") {
    renamer.add_vector({"P#"}, ned, "position");
    renamer.add_vector({"V#"}, ned, "velocity");
  } else if (message == "ATT") {
    renamer.add_vector({"#"}, {"Roll", "Pitch", "Yaw"}, "euler", kDegree_rad);
  } else if (message == "IMU") {
    renamer.add_vector({"Acc#"}, capital, "specific_force_body");
    renamer.add_vector({"Gyr#"}, capital, "rate");
  } else if (message == "BAT" || message == "CURR") {
    renamer.add("Volt", "battery_volt", 1);
  } else if (message == "RCOU") {
    add_ardupilot_outputs(topic, parameters);
  } else if (message == "CTUN") {
    renamer.add("ThO", "thrust_command_normalised", 1);
  }
}

/// Returns true if no column other than the clocks ever changes.
bool is_constant(const RawTopic& topic) {
  return std::all_of(topic.columns.begin(), topic.columns.end(), [](const RawColumn& column) {
    return column.name.find("timestamp") != std::string::npos ||
           std::all_of(column.values.begin(), column.values.end(), [&](double value) {
             return value == column.values[0] || (std::isnan(value) && std::isnan(column.values[0]));
           });
  });
}

/// Returns whether `holds` is true for any value of `column` in topics of that name; unknown without such a column.
Armed any_record(const RawLog& log, const std::string& message, const std::string& column,
                 const std::function<bool(double)>& holds) {
  Armed armed = Armed::kUnknown;
  for (const RawTopic& topic : log.topics) {
    const RawColumn* const found = message_of(topic) == message ? topic.find(column) : nullptr;
    if (found == nullptr || found->values.empty()) continue;
    armed = Armed::kNever;
    if (std::any_of(found->values.begin(), found->values.end(), holds)) return Armed::kYes;
  }
  return armed;
}

}  // namespace

void add_own_names(RawLog& log, std::vector<std::string>& notes) {
  // Use the first instance of each message; otherwise other instances would fill in columns that the first one lacks.
  // Constant instances are skipped: they belong to a missing battery or to outputs without motors.
  std::map<std::string, std::pair<bool, int>> first;  // whether it is constant, and its number
  for (const RawTopic& topic : log.topics) {
    const std::pair<bool, int> instance = {is_constant(topic), topic.instance};
    const auto [known, is_new] = first.emplace(message_of(topic), instance);
    if (!is_new) known->second = std::min(known->second, instance);
  }
  const bool is_ardupilot = log.format.find("ardupilot") != std::string::npos;
  for (RawTopic& topic : log.topics) {
    const std::string message = message_of(topic);
    if (topic.instance != first[message].second) continue;
    if (is_ardupilot)
      add_ardupilot(topic, log.parameters);
    else if (message == "actuator_outputs" && first.count("actuator_motors") != 0)
      continue;  // the same commands, scaled to servo signals
    else if (log.format == "ulog" || topic.type.rfind("px4_msgs", 0) == 0)
      add_px4(topic, message, notes);
  }
}

void add_landed(const RawLog& raw, Log& log) {
  struct Detector {
    const char *message, *column;
    bool landed;  ///< what a value other than zero means
  };
  for (const Detector& detector :
       {Detector{"vehicle_land_detected", "landed", true}, Detector{"STAT", "isFlying", false}}) {
    for (const RawTopic& topic : raw.topics) {
      const RawColumn* const state = topic.find(detector.column);
      if (message_of(topic) != detector.message || state == nullptr) continue;
      const std::size_t n = std::min(state->values.size(), topic.time_s.size());
      const auto is_landed = [&](std::size_t i) { return (state->values[i] != 0) == detector.landed; };
      for (std::size_t i = 0; i < n;) {
        std::size_t end = i;
        while (end < n && is_landed(end)) ++end;
        const double start_s = topic.time_s[i];
        // The last state holds until the end of the log.
        const double end_s = end < n ? topic.time_s[end] : INFINITY;
        if (end > i)
          log.events.push_back({"landed", start_s, end_s - start_s, "reported by the land detector"});
        i = std::max(end, i + 1);
      }
      return;
    }
  }
}

Armed was_armed(const RawLog& log) {
  constexpr double kArmedState = 2;  // vehicle_status.ARMING_STATE_ARMED
  for (const Armed armed :
       // ArduPilot writes ARM when the state changes: a vehicle that was disarmed had been armed.
       {any_record(log, "ARM", "ArmState", [](double) { return true; }),
        any_record(log, "actuator_armed", "armed", [](double x) { return x != 0; }),
        any_record(log, "vehicle_status", "arming_state", [](double x) { return x == kArmedState; }),
        any_record(log, "STAT", "Armed", [](double x) { return x != 0; })}) {
    if (armed != Armed::kUnknown) return armed;
  }
  return Armed::kUnknown;
}

std::string vehicle_without_rotors(const RawLog& log) {
  // VehicleStatus.msg of PX4; a vehicle that is at times a rotary wing counts as one.
  constexpr double kRotaryWing = 1;
  static const char* const types[] = {"", "", "fixed wing", "rover", "airship"};
  std::string vehicle;
  for (const RawTopic& topic : log.topics) {
    const RawColumn* const found =
        message_of(topic) == "vehicle_status" ? topic.find("vehicle_type") : nullptr;
    if (found == nullptr) continue;
    for (const double value : found->values) {
      if (value == kRotaryWing) return "";
      if (value > kRotaryWing && value < std::size(types)) vehicle = types[static_cast<std::size_t>(value)];
    }
  }
  // The airframe says more than the type of some firmware: ranges of PX4's airframes reference.
  struct Airframes {
    double first, last;
    const char* vehicle;
  };
  const auto airframe = log.parameters.find("SYS_AUTOSTART");
  for (const Airframes& range : {Airframes{2100, 3999, "fixed wing"}, Airframes{50000, 50999, "rover"},
                                 Airframes{60000, 60999, "submarine"}}) {
    if (airframe != log.parameters.end() && airframe->second >= range.first && airframe->second <= range.last)
      return range.vehicle;
  }
  if (!vehicle.empty()) return vehicle;
  // ArduPilot writes the name and version of its firmware.
  static const std::pair<const char*, const char*> firmwares[] = {
      {"ArduPlane", "fixed wing"}, {"ArduRover", "rover"}, {"ArduSub", "submarine"}};
  for (const RawMessage& message : log.messages) {
    for (const auto& [firmware, kind] : firmwares)
      if (message.text.rfind(firmware, 0) == 0) return kind;
  }
  return "";
}

}  // namespace swarmcert::logs

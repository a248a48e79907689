#include "analysis/logs/message_frames.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "analysis/logs/clock.h"
#include "analysis/logs/dictionary.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

using Parameters = std::map<std::string, double>;
constexpr std::size_t kMostMotors = 8;

/// Returns the name under which part `k` of a signal is found: "position_x".
std::string own_name(int signal, std::size_t k) {
  const auto own = std::find_if(column_names().begin(), column_names().end(), [&](const NamedColumns& row) {
    return row.origin == Origin::kOwn && row.signal == signal;
  });
  std::string name = own->names[k];
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

/// Returns the outputs of motors 1, 2, ... by the parameters with their functions; empty if these assign fewer than
/// three motors.
std::vector<std::string> outputs_of_motors(const NamedColumns& row, const Parameters& parameters) {
  std::vector<std::string> outputs(kMostMotors);
  for (std::size_t n = 0; n < row.names.size() && !row.functions.empty(); ++n) {
    std::string name = row.functions;
    const auto found = parameters.find(name.replace(name.find('#'), 1, std::to_string(n + 1)));
    if (found == parameters.end()) continue;
    const double motor = found->second - row.first_function;
    if (motor >= 0 && motor < kMostMotors) outputs[static_cast<std::size_t>(motor)] = row.names[n];
  }
  outputs.erase(std::find(outputs.begin(), outputs.end(), ""), outputs.end());
  return outputs.size() < 3 ? std::vector<std::string>() : outputs;
}

/// Outputs in use have numbers; as servo signals in microseconds (values below about 900 mean off), changing ones.
bool is_in_use(const std::vector<double>& values, const std::string& unit) {
  if (unit != "us") return holds_numbers(values);
  if (values.empty()) return false;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high >= 900 && *high <= 2500 && *high != *low;
}

/// Adds commands of motors, 0 .. 1: those that parameters assign, else the consecutive outputs in use.
void add_outputs(RawTopic& topic, const NamedColumns& row, const Parameters& parameters) {
  std::vector<std::string> outputs = outputs_of_motors(row, parameters);
  const bool is_assigned = !outputs.empty();
  for (const std::string& output : outputs)
    if (topic.find(output) == nullptr) return;  // it is in another message, with separate times
  if (!is_assigned) outputs = row.names;
  const auto limit = [&](std::size_t which, double otherwise) {
    const auto found = is_assigned ? parameters.find(row.limits.at(which)) : parameters.end();
    return found != parameters.end() && found->second > 0 ? found->second : otherwise;
  };
  const double first = row.factor.offset, last = first + row.factor.divide / row.factor.multiply;
  double low = limit(0, first), high = limit(1, last);
  if (!(high > low)) low = first, high = last;
  for (std::size_t k = 0; k < std::min(outputs.size(), kMostMotors); ++k) {
    const RawColumn* const column = topic.find(outputs[k]);
    if (column == nullptr || (!is_assigned && !is_in_use(column->values, row.unit))) return;
    RawColumn command{own_name(kMotorCommand, k), column->values};
    for (double& value : command.values)  // disarmed: no number
      value = std::isfinite(value) ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0;
    topic.columns.push_back(std::move(command));
  }
}

/// Adds the columns of one row of the dictionary under our own names, if all of them exist.
void add_columns(RawTopic& topic, const NamedColumns& row) {
  const bool has_all = std::all_of(row.names.begin(), row.names.end(),
                                   [&](const std::string& name) { return topic.find(name) != nullptr; });
  for (std::size_t k = 0; has_all && k < row.names.size(); ++k) {
    RawColumn copy{own_name(row.signal, k), topic.find(row.names[k])->values};
    if (topic.find(copy.name) != nullptr) continue;
    for (double& value : copy.values) value *= row.sign[k] * row.factor.multiply / row.factor.divide;
    topic.columns.push_back(std::move(copy));
  }
}

/// Leaves out the records that the estimator does not mark as valid or, if they are most, the columns.
void remove_invalid(RawTopic& topic, const Sign& sign, RawLog& log, std::vector<std::string>& notes) {
  const RawColumn* const flag = topic.find(sign.column);
  if (flag == nullptr) return;
  std::vector<std::size_t> valid, invalid;
  for (std::size_t i = 0; i < flag->values.size(); ++i)
    (sign.is_within(flag->values[i]) ? valid : invalid).push_back(i);
  if (invalid.empty()) return;
  const std::string why = fmt::format("the estimator says {} = {:g}", sign.column, flag->values[invalid[0]]);
  if (valid.size() >= invalid.size()) {
    log.left_out.push_back({topic.name, why, invalid.size()});
    return keep_records(topic, valid);
  }
  for (RawColumn& column : topic.columns) {
    if (std::find(sign.of.begin(), sign.of.end(), column.name) == sign.of.end()) continue;
    column.values.assign(column.values.size(), NAN);
    notes.push_back("not used: " + topic.name + ": " + column.name + ": " + why);
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

/// Returns whether any record of the sign's message is within its range; unknown without such a column.
Armed any_record(const RawLog& log, const Sign& sign) {
  Armed armed = Armed::kUnknown;
  for (const RawTopic& topic : log.topics) {
    const RawColumn* const found = message_of(topic) == sign.message ? topic.find(sign.column) : nullptr;
    if (found == nullptr || found->values.empty()) continue;
    armed = Armed::kNever;
    for (const double value : found->values)
      if (sign.is_within(value)) return Armed::kYes;
  }
  return armed;
}

}  // namespace

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

std::string firmware_of(const RawLog& log, const RawTopic& topic) {
  if (log.format == "ardupilot") return "ardupilot";
  return log.format == "ulog" || topic.type.rfind("px4_msgs", 0) == 0 ? "px4" : "";
}

void add_own_names(RawLog& log, std::vector<std::string>& notes) {
  // Use the first instance of each message; otherwise other instances would fill in columns that the first one lacks.
  // Constant instances are skipped: they belong to a missing battery or to outputs without motors.
  std::map<std::string, std::pair<bool, int>> first;  // whether it is constant, and its number
  for (const RawTopic& topic : log.topics) {
    const std::pair<bool, int> instance = {is_constant(topic), topic.instance};
    const auto [known, is_new] = first.emplace(message_of(topic), instance);
    if (!is_new) known->second = std::min(known->second, instance);
  }
  for (RawTopic& topic : log.topics) {
    const std::string message = message_of(topic), firmware = firmware_of(log, topic);
    if (topic.instance != first[message].second || firmware.empty()) continue;
    for (const Sign& sign : signs_of_state())
      if (sign.means == "valid" && sign.message == message) remove_invalid(topic, sign, log, notes);
    for (const NamedColumns& row : column_names()) {
      if (row.program != firmware || row.message != message || first.count(row.instead_of) != 0 ||
          row.signal == kTime)
        continue;
      if (row.signal == kMotorCommand)
        add_outputs(topic, row, log.parameters);
      else
        add_columns(topic, row);
    }
  }
}

void add_landed(const RawLog& raw, Log& log) {
  for (const Sign& sign : signs_of_state()) {
    for (const RawTopic& topic : raw.topics) {
      const RawColumn* const state = topic.find(sign.column);
      if (sign.means != "landed" || message_of(topic) != sign.message || state == nullptr) continue;
      const std::size_t n = std::min(state->values.size(), topic.time_s.size());
      const auto is_landed = [&](std::size_t i) { return sign.is_within(state->values[i]); };
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
  Armed armed = Armed::kUnknown;
  for (const Sign& sign : signs_of_state())
    if (sign.means == "armed") armed = std::max(armed, any_record(log, sign));
  return armed;
}

std::string vehicle_without_rotors(const RawLog& log) {
  for (const Sign& sign : signs_of_vehicle()) {
    const auto parameter = log.parameters.find(sign.parameter);
    const bool holds =
        (parameter != log.parameters.end() && sign.is_within(parameter->second)) ||
        (!sign.column.empty() && any_record(log, sign) == Armed::kYes) ||
        (!sign.text.empty() && std::any_of(log.messages.begin(), log.messages.end(),
                                           [&](const std::string& m) { return m.rfind(sign.text, 0) == 0; }));
    if (holds) return sign.means == "multirotor" ? "" : sign.means;
  }
  return "";
}

}  // namespace swarmcert::logs

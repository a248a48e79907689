#include "analysis/logs/recognition.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::logs {
namespace {

/// The columns of one topic, indexed by all names under which they can be found. The table of names is long, so one
/// pass over the columns replaces comparing every column with every name.
class ColumnIndex {
 public:
  explicit ColumnIndex(const RawTopic& topic) {
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      const std::string& name = topic.columns[c].name;
      const auto index = static_cast<int>(c);
      exact_.emplace(name, index);
      const std::string plain = plain_name(name);
      for (std::string& called : called_names(plain)) plain_.emplace(std::move(called), index);
      StatedUnit stated = stated_unit(name);
      if (stated.plain == plain) continue;
      units_.emplace(index, std::move(stated.unit));
      for (std::string& called : called_names(stated.plain)) before_unit_.emplace(std::move(called), index);
    }
  }

  /// Returns one index per name; -1 if the topic has no such column. The first column with a name is used. A column
  /// whose name continues with a unit is used only if no other has the name, and only with a unit of `signal`.
  std::vector<int> columns_called(int signal, const std::vector<std::string>& names) const {
    std::vector<int> columns;
    for (const std::string& name : names) {
      if (name.find('[') != std::string::npos) {
        columns.push_back(find(exact_, name));
        continue;
      }
      columns.push_back(find(plain_, name));
      if (columns.back() >= 0) continue;
      const int longer = find(before_unit_, name);
      if (longer >= 0 && unit_factor(signal, units_.at(longer))) columns.back() = longer;
    }
    return columns;
  }

 private:
  using Names = std::unordered_map<std::string, int>;

  static int find(const Names& names, const std::string& name) {
    const auto found = names.find(name);
    return found == names.end() ? -1 : found->second;
  }

  Names exact_, plain_, before_unit_;
  std::unordered_map<int, std::string> units_;  ///< of the columns of `before_unit_`
};

/// Returns the unit that the name of column k of `carried` states, "X (mm)", "roll_deg"; empty if it states none in
/// which the signal can be.
std::string stated_by_column(const RawTopic& topic, const NamedColumns& row, const Carried& carried,
                             std::size_t k) {
  const std::string& name = topic.columns[static_cast<std::size_t>(carried.columns[k])].name;
  const std::string plain = plain_name(name);
  const StatedUnit stated = stated_unit(name);
  // "pwm" of pwm.m1_pwm belongs to the name that the firmware gives.
  const std::vector<std::string> called = called_names(plain);
  if (stated.plain != plain && std::find(called.begin(), called.end(), row.names[k]) != called.end())
    return "";
  return unit_factor(carried.signal, stated.unit) ? stated.unit : "";
}

/// Returns whether all columns of a group state the same unit, or none: a group has one factor.
bool have_one_unit(const RawTopic& topic, const NamedColumns& row, const Carried& carried) {
  std::set<std::string> units;
  for (std::size_t k = 0; k < carried.size(); ++k)
    if (carried.columns[k] >= 0) units.insert(stated_by_column(topic, row, carried, k));
  return units.size() <= 1;
}

/// Applies the unit that the columns state in their names instead of the name's default unit. Duties keep theirs,
/// because values called PWM have any scale. Accelerations without a unit are judged by their norm.
void take_stated_unit(const RawTopic& topic, const NamedColumns& row, Carried& carried) {
  const bool is_exact = row.names[0].find('[') != std::string::npos;
  if (is_exact || row.ask == Ask::kMotors || row.ask == Ask::kAcceleration) return;
  std::size_t first = 0;
  while (carried.columns[first] < 0) ++first;
  const std::string unit = stated_by_column(topic, row, carried, first);
  if (unit.empty()) return;
  const UnitFactor factor = *unit_factor(carried.signal, unit);
  carried.multiply = factor.multiply;
  carried.divide = factor.divide;
  carried.unit = unit;
  if (carried.ask == Ask::kAngles) carried.ask = Ask::kNothing;
}

/// Returns false for groups that need all their columns: a vertical velocity alone is useful, half a quaternion is not.
/// "north" and "east" occur in both north, east, down and east, north, up.
bool may_be_partial(const NamedColumns& row) {
  if (row.ask == Ask::kNorthEastDown || row.ask == Ask::kEastNorthUp) return false;
  const int signal = row.signal;
  return signal == kEuler || signal == kPosition || signal == kVelocity || signal == kTargetPosition ||
         signal == kTargetVelocity;
}

/// Ignores columns without any number.
void drop_empty_columns(const RawTopic& topic, Carried& carried) {
  if (topic.time_s.empty()) return;
  for (int& c : carried.columns) {
    if (c < 0) continue;
    const std::vector<double>& values = topic.columns[static_cast<std::size_t>(c)].values;
    if (std::none_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); })) c = -1;
  }
}

bool is_dead(const RawTopic& topic, const Carried& carried) {
  bool any = false;
  for (const int c : carried.columns) {
    if (c < 0) continue;
    for (const double value : topic.columns[static_cast<std::size_t>(c)].values) {
      if (std::isfinite(value) && value != 0) any = true;
    }
  }
  return !any;
}

/// Motors are at rest in a log on the ground, so their zeros are valid. So are setpoints at the origin.
bool may_be_zero(int signal) {
  return signal == kDuty || signal == kRequested || signal == kMotorCommand || signal == kThrust ||
         signal == kThrustCommand || signal == kTorque || signal == kMotorForce ||
         signal == kTargetVelocity || signal == kTargetPosition;
}

bool is_unit_quaternion(const RawTopic& topic, const Carried& carried) {
  std::size_t unit = 0;
  for (std::size_t i = 0; i < topic.time_s.size(); ++i) {
    double norm = 0;
    for (const int c : carried.columns) {
      const double q = topic.columns[static_cast<std::size_t>(c)].values[i];
      norm += q * q;
    }
    if (std::abs(norm - 1) < 0.05) ++unit;
  }
  return 2 * unit >= topic.time_s.size();
}

/// A position in a topic of setpoints is a desired one.
bool is_wish(const RawTopic& topic, int signal) {
  const bool may_be = signal == kTargetPosition || signal == kTargetVelocity || signal == kMotorCommand ||
                      signal == kThrustCommand || signal == kThrust || signal == kTorque ||
                      signal == kMotorForce;
  if (may_be) return false;
  const std::string name = plain_name(topic.name);
  for (const char* const word :
       {"setpoint", "set.point", "target", "reference", "desired", "command", "cmd"}) {
    if (name.find(word) != std::string::npos) return true;
  }
  return false;
}

void recognise_by_names(const RawLog& log, Recognition& found) {
  const std::vector<ColumnIndex> indices(log.topics.begin(), log.topics.end());
  for (const NamedColumns& row : column_names()) {
    if (found.find(row.signal) != nullptr) continue;
    for (std::size_t t = 0; t < log.topics.size() && found.find(row.signal) == nullptr; ++t) {
      Carried carried{
          row.signal, t,      indices[t].columns_called(row.signal, row.names), row.unit, row.multiply,
          row.divide, row.ask};
      drop_empty_columns(log.topics[t], carried);
      const auto missing = std::count(carried.columns.begin(), carried.columns.end(), -1);
      const auto size = static_cast<std::ptrdiff_t>(carried.columns.size());
      if (missing == size || (missing > 0 && !may_be_partial(row))) continue;
      if (is_wish(log.topics[t], row.signal)) continue;
      const bool is_quaternion = row.signal == kAttitude;
      if (!log.topics[t].time_s.empty() && ((is_dead(log.topics[t], carried) && !may_be_zero(row.signal)) ||
                                            (is_quaternion && !is_unit_quaternion(log.topics[t], carried)))) {
        found.rejected.push_back(names_of(log, carried) +
                                 (is_quaternion ? ": no unit quaternions" : ": only zeros"));
        continue;
      }
      if (!have_one_unit(log.topics[t], row, carried)) {
        found.rejected.push_back(names_of(log, carried) + ": different units");
        continue;
      }
      take_stated_unit(log.topics[t], row, carried);
      found.groups.push_back(std::move(carried));
    }
  }
}

void recognise_by_map(const RawLog& log, const SignalMap& map, Recognition& found) {
  std::vector<std::string> names;
  for (const RawTopic& topic : log.topics) {
    for (const RawColumn& column : topic.columns) names.push_back(column.name);
  }
  for (const SignalSource& source : map) {
    if (source.signal == kTime) continue;
    Carried carried{source.signal, 0, {-1}, source.unit, source.multiply, source.divide, Ask::kNothing};
    for (std::size_t t = 0; t < log.topics.size() && carried.columns[0] < 0; ++t) {
      for (std::size_t c = 0; c < log.topics[t].columns.size(); ++c) {
        if (log.topics[t].columns[c].name != source.column) continue;
        carried.topic = t;
        carried.columns[0] = static_cast<int>(c);
        break;
      }
    }
    if (carried.columns[0] < 0) {
      throw files::InputError({log.path, "line 1", "column", files::in_quotes(source.column),
                               "is not a column of this log, but columns.toml names it",
                               files::did_you_mean(source.column, names)});
    }
    if (found.find(source.signal) == nullptr) found.groups.push_back(std::move(carried));
  }
}

}  // namespace

const Carried* Recognition::find(int signal) const {
  for (const Carried& carried : groups) {
    if (carried.signal == signal) return &carried;
  }
  return nullptr;
}

Recognition recognise(const RawLog& log, const SignalMap& map) {
  Recognition found;
  if (map.empty())
    recognise_by_names(log, found);
  else
    recognise_by_map(log, map, found);
  // Angles that are redundant beside a quaternion must not cost records where they are missing.
  if (map.empty() && (found.find(kAttitude) != nullptr || found.find(kPackedAttitude) != nullptr)) {
    found.groups.erase(std::remove_if(found.groups.begin(), found.groups.end(),
                                      [](const Carried& carried) { return carried.signal == kEuler; }),
                       found.groups.end());
  }
  for (const int signal : {kForceBody, kForceWorld, kAccelerationWorld, kVelocity, kPosition}) {
    if (const Carried* const carried = found.find(signal)) found.clock = carried->topic;
  }
  return found;
}

Carried time_column(const RawTopic& topic, const SignalMap& map) {
  Carried time{kTime, 0, {-1}, "us", 1, 1, Ask::kNothing};
  for (const SignalSource& source : map) {
    for (std::size_t c = 0; c < topic.columns.size() && source.signal == kTime; ++c) {
      if (topic.columns[c].name != source.column) continue;
      time.columns[0] = static_cast<int>(c);
      time.unit = source.unit;
      time.multiply = source.multiply;
      time.divide = source.divide;
      return time;
    }
  }
  // "time[ms]" of the published CSV files is in microseconds.
  for (const char* const name : {"tick", "time_us", "time[ms]"}) {
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      if (topic.columns[c].name != name) continue;
      time.columns[0] = static_cast<int>(c);
      return time;
    }
  }
  return time;
}

std::string names_of(const RawLog& log, const Carried& carried) {
  std::string names;
  for (const int c : carried.columns) {
    if (c < 0) continue;
    names +=
        (names.empty() ? "" : ", ") + log.topics[carried.topic].columns[static_cast<std::size_t>(c)].name;
  }
  return names;
}

}  // namespace swarmcert::logs

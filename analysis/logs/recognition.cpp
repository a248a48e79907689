#include "analysis/logs/recognition.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "analysis/logs/statistics_of_series.h"
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
      add(plain, index, &Names::plain);
      StatedUnit stated = stated_unit(name);
      if (stated.plain == plain) continue;
      units_.emplace(index, std::move(stated.unit));
      add(stated.plain, index, &Names::before_unit);
    }
  }

  /// Returns one index per name; -1 if the topic has no such column. The first column with a name is used. A column
  /// whose name continues with a unit is used only if no other has the name, and only with a unit of `signal`.
  /// @param is_shortened compare with the names without their first words
  std::vector<int> columns_called(int signal, const std::vector<std::string>& names,
                                  bool is_shortened) const {
    const Names& known = is_shortened ? shortened_ : whole_;
    std::vector<int> columns;
    for (const std::string& name : names) {
      if (name.find('[') != std::string::npos) {
        columns.push_back(find(exact_, name));
        continue;
      }
      columns.push_back(find(known.plain, name));
      if (columns.back() >= 0) continue;
      const int longer = find(known.before_unit, name);
      if (longer >= 0 && unit_factor(signal, units_.at(longer))) columns.back() = longer;
    }
    return columns;
  }

 private:
  using Index = std::unordered_map<std::string, int>;
  struct Names {
    Index plain, before_unit;
  };

  void add(const std::string& plain, int index, Index Names::*names) {
    const std::vector<std::string> called = called_names(plain);
    (whole_.*names).emplace(called[0], index);
    if (called.size() > 1) (shortened_.*names).emplace(called[1], index);
  }

  static int find(const Index& names, const std::string& name) {
    const auto found = names.find(name);
    return found == names.end() ? -1 : found->second;
  }

  Index exact_;
  Names whole_, shortened_;
  std::unordered_map<int, std::string> units_;  ///< of the columns of `before_unit`
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

/// Returns the derivative of `values` over about kSpan_s.
std::vector<double> slope_of(const std::vector<double>& time_s, const std::vector<double>& values) {
  constexpr double kSpan_s = 0.1;
  std::vector<double> slope(values.size(), NAN);
  for (std::size_t from = 0, to = 0; to < values.size(); ++to) {
    while (time_s[to] - time_s[from] > kSpan_s) ++from;
    const std::size_t middle = (from + to) / 2;
    if (time_s[to] > time_s[from]) slope[middle] = (values[to] - values[from]) / (time_s[to] - time_s[from]);
  }
  return slope;
}

/// Returns whether the derivative of one vector follows another, on average over the axes that both have.
bool is_derivative(const RawTopic& topic, const Carried& of, const Carried& derivative) {
  constexpr double kFollows = 0.5;
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < of.size() && k < derivative.size(); ++k) {
    if (of.columns[k] < 0 || derivative.columns[k] < 0) continue;
    const auto values = [&](const Carried& carried) -> const std::vector<double>& {
      return topic.columns[static_cast<std::size_t>(carried.columns[k])].values;
    };
    const Line line = line_through(slope_of(topic.time_s, values(of)), values(derivative));
    if (!std::isfinite(line.correlation)) continue;
    sum += line.correlation;
    ++count;
  }
  return count == 0 || sum > kFollows * count;
}

/// An accelerometer shows gravity, or else its columns are the derivative of the velocity.
bool shows_gravity(const RawTopic& topic, const Carried& carried) {
  constexpr double kShare = 0.8;  // of the mean over the mean size
  Vector sum{};
  double size = 0;
  for (std::size_t i = 0; i < topic.time_s.size(); ++i) {
    double squares = 0;
    Vector now{};
    for (std::size_t k = 0; k < 3; ++k) {
      now[k] = topic.columns[static_cast<std::size_t>(carried.columns[k])].values[i];
      squares += now[k] * now[k];
    }
    if (!std::isfinite(squares)) continue;
    for (std::size_t k = 0; k < 3; ++k) sum[k] += now[k];
    size += std::sqrt(squares);
  }
  return std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) > kShare * size;
}

/// Returns whether motion confirms a group whose name fits only without its first word: "drone_vel_x" may be the
/// velocity, "wind_vel_x" is not. A velocity needs a position to be confirmed by.
bool is_confirmed(const RawLog& log, const Recognition& found, const Carried& carried) {
  const RawTopic& topic = log.topics[carried.topic];
  const auto same_topic = [&](int signal) {
    const Carried* const other = found.find(signal);
    return other != nullptr && other->topic == carried.topic ? other : nullptr;
  };
  if (topic.time_s.empty()) return true;
  const Carried *const position = same_topic(kPosition), *const velocity = same_topic(kVelocity);
  switch (carried.signal) {
    case kPosition:
      return velocity == nullptr || is_derivative(topic, carried, *velocity);
    case kVelocity:
      return position != nullptr && is_derivative(topic, *position, carried);
    case kForceWorld:
    case kForceBody:
      return shows_gravity(topic, carried) ||
             (velocity != nullptr && is_derivative(topic, *velocity, carried));
    default:
      return true;
  }
}

/// Messages of known firmware carry signals only under the names of message_frames.h.
bool has_own_names(const RawLog& log, const RawTopic& topic) {
  return log.format == "ulog" || log.format == "ardupilot" || topic.type.rfind("px4_msgs", 0) == 0;
}

void recognise_row(const RawLog& log, const std::vector<ColumnIndex>& indices, const NamedColumns& row,
                   bool is_shortened, Recognition& found) {
  for (std::size_t t = 0; t < log.topics.size() && found.find(row.signal) == nullptr; ++t) {
    if (row.origin != Origin::kOwn && has_own_names(log, log.topics[t])) continue;
    Carried carried{row.signal,
                    t,
                    indices[t].columns_called(row.signal, row.names, is_shortened),
                    row.unit,
                    row.multiply,
                    row.divide,
                    row.ask};
    const std::vector<int> named = carried.columns;
    drop_empty_columns(log.topics[t], carried);
    const auto missing = std::count(carried.columns.begin(), carried.columns.end(), -1);
    const auto size = static_cast<std::ptrdiff_t>(carried.columns.size());
    if (missing == size || (missing > 0 && !may_be_partial(row))) continue;
    if (is_wish(log.topics[t], row.signal)) continue;
    const auto reject = [&](const char* why) {
      found.rejected.push_back(names_of(log, carried) + ": " + why);
    };
    const bool is_quaternion = row.signal == kAttitude;
    if (!log.topics[t].time_s.empty() && ((is_dead(log.topics[t], carried) && !may_be_zero(row.signal)) ||
                                          (is_quaternion && !is_unit_quaternion(log.topics[t], carried)))) {
      reject(is_quaternion ? "no unit quaternions" : "only zeros");
    } else if (!have_one_unit(log.topics[t], row, carried)) {
      reject("different units");
    } else if (is_shortened && !is_confirmed(log, found, carried)) {
      reject("the motion contradicts what the name could mean without its first word");
    } else {
      take_stated_unit(log.topics[t], row, carried);
      for (std::size_t k = 0; k < named.size(); ++k) {
        if (carried.columns[k] == named[k]) continue;
        const std::string& column = log.topics[t].columns[static_cast<std::size_t>(named[k])].name;
        found.rejected.push_back(column + ": it holds no number");
      }
      found.groups.push_back(std::move(carried));
    }
  }
}

void recognise_by_names(const RawLog& log, Recognition& found) {
  const std::vector<ColumnIndex> indices(log.topics.begin(), log.topics.end());
  const auto recognise_rows = [&](bool of_people, const std::vector<bool>& shortened) {
    for (const NamedColumns& row : column_names()) {
      if ((row.origin == Origin::kPeople) != of_people) continue;
      for (const bool is_shortened : shortened) recognise_row(log, indices, row, is_shortened, found);
    }
  };
  recognise_rows(false, {false, true});
  // Of common words, any that fits as a whole comes before one that fits only without its first word.
  recognise_rows(true, {false});
  recognise_rows(true, {true});
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
  for (const char* const name : {"time_us", "time[ms]"}) {
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

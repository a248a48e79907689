#include "analysis/logs/recognition.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "analysis/logs/assignment.h"
#include "analysis/logs/column_groups.h"
#include "analysis/logs/column_names.h"
#include "analysis/logs/message_frames.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::logs {
namespace {

/// The columns of one topic, indexed by the names under which they can be found. The table of names is long, so one
/// pass over the columns replaces comparing every column with every name.
class ColumnIndex {
 public:
  explicit ColumnIndex(const RawTopic& topic) {
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      const std::string& name = topic.columns[c].name;
      const auto index = static_cast<int>(c);
      whole_.emplace(name, index);
      const std::string plain = plain_name(name);
      whole_.emplace(plain, index);
      // "cf1.att.stateestimate.qx" is also found as "stateestimate.qx".
      for (std::size_t dot = plain.find('.'); dot < plain.rfind('.'); dot = plain.find('.', dot + 1)) {
        const NameReading before = read_name(plain.substr(0, dot));
        if (before.is_foreign || before.is_wish || read_name(name).is_foreign) break;
        shortened_.emplace(plain.substr(dot + 1), index);
      }
    }
  }

  /// Returns one index per name; -1 if the topic has no such column. The first column with a name is used.
  /// @param is_shortened compare with the names without their first words
  std::vector<int> columns_called(const std::vector<std::string>& names, bool is_shortened) const {
    std::vector<int> columns;
    for (const std::string& name : names) {
      const Index& known = is_shortened && name.find('[') == std::string::npos ? shortened_ : whole_;
      const auto found = known.find(name);
      columns.push_back(found == known.end() ? -1 : found->second);
    }
    return columns;
  }

 private:
  using Index = std::unordered_map<std::string, int>;
  Index whole_, shortened_;
};

/// Ignores columns without any number.
void drop_empty_columns(const RawTopic& topic, Carried& carried) {
  for (int& c : carried.columns)
    if (c >= 0 && !topic.time_s.empty() && !holds_numbers(topic.columns[static_cast<std::size_t>(c)].values))
      c = -1;
}

void recognise_row(const RawLog& log, const std::vector<ColumnIndex>& indices, const NamedColumns& row,
                   bool is_shortened, Recognition& found) {
  for (std::size_t t = 0; t < log.topics.size() && found.find(row.signal) == nullptr; ++t) {
    const RawTopic& topic = log.topics[t];
    if (row.origin != Origin::kOwn && !firmware_of(log, topic).empty()) continue;
    const bool is_of_messages =
        row.origin == Origin::kMessages || (row.origin == Origin::kOwn && log.format == "csv");
    if (is_of_messages && is_plain_table(log, topic)) continue;
    const std::vector<int> named = indices[t].columns_called(row.names, is_shortened);
    Carried carried{row.signal, t, named, row.unit, row.factor, row.ask, row.sign};
    drop_empty_columns(topic, carried);
    const auto missing = std::count(carried.columns.begin(), carried.columns.end(), -1);
    const auto size = static_cast<std::ptrdiff_t>(carried.columns.size());
    const SignalKind& kind = kind_of_signal(row.signal);
    // A position in a topic of set points is a desired one.
    const bool is_wish = !kind.is_command && read_name(topic.name).is_wish;
    if (missing == size || (missing > 0 && !kind.may_be_partial) || is_wish) continue;
    const bool is_quaternion = row.signal == kAttitude;
    const bool is_sound = is_quaternion ? is_unit_quaternion(topic, carried.columns)
                                        : kind.is_command || !is_dead(topic, carried);
    if (!topic.time_s.empty() && !is_sound) {
      found.rejected.push_back(names_of(log, carried) +
                               (is_quaternion ? ": no unit quaternions" : ": only zeros"));
      continue;
    }
    for (std::size_t k = 0; k < named.size(); ++k)
      if (carried.columns[k] != named[k])
        found.rejected.push_back(topic.columns[static_cast<std::size_t>(named[k])].name +
                                 ": it holds no number");
    found.groups.push_back(std::move(carried));
  }
}

void recognise_by_names(const RawLog& log, Recognition& found) {
  const std::vector<ColumnIndex> indices(log.topics.begin(), log.topics.end());
  std::set<std::string> programs;  // of which names are found
  for (const NamedColumns& row : column_names()) {
    if (row.origin == Origin::kFirmware || row.signal == kTime) continue;
    if (row.origin == Origin::kCommonWords && programs.count(row.program) == 0 && log.format != "usd")
      continue;
    const std::size_t before = found.groups.size();
    recognise_row(log, indices, row, false, found);
    if (row.origin == Origin::kPrograms) recognise_row(log, indices, row, true, found);
    if (found.groups.size() > before) programs.insert(row.program);
  }
}

/// Adds the column of one signal to the group of its topic that has its unit, up to the sign.
void join(Carried one, Recognition& found) {
  const int first = kind_of_signal(one.signal).first;
  const auto place = static_cast<std::size_t>(one.signal - first);
  Carried* group = found.find(first);
  UnitFactor factor = one.factor;
  factor.multiply = std::abs(factor.multiply);
  const bool is_alike = group != nullptr && group->topic == one.topic &&
                        is_same_scale(group->factor, factor) && group->factor.offset == factor.offset;
  if (group != nullptr && !is_alike) return found.groups.push_back(std::move(one));
  if (group == nullptr) {
    found.groups.push_back(one);
    group = &found.groups.back();
    group->signal = first;
    group->columns.clear();
    group->factor = factor;
    if (one.factor.multiply < 0) group->unit.erase(0, 1);
  }
  if (group->columns.size() <= place) group->columns.resize(place + 1, -1);
  group->columns[place] = one.columns[0];
  if (one.factor.multiply < 0) group->sign[place] = -1;
}

void recognise_by_map(const RawLog& log, const SignalMap& map, Recognition& found) {
  std::vector<std::string> names;
  for (const RawTopic& topic : log.topics) {
    for (const RawColumn& column : topic.columns) names.push_back(column.name);
  }
  for (const SignalSource& source : map) {
    if (source.signal == kTime) continue;
    Carried carried{source.signal, 0, {-1}, source.unit, source.factor};
    for (std::size_t t = 0; t < log.topics.size() && carried.columns[0] < 0; ++t) {
      for (std::size_t c = 0; c < log.topics[t].columns.size(); ++c) {
        const std::string& name = log.topics[t].columns[c].name;
        if (name != source.column && log.topics[t].name + ": " + name != source.column) continue;
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
    join(std::move(carried), found);
  }
}

}  // namespace

const Carried* Recognition::find(int signal) const {
  for (const Carried& carried : groups) {
    if (carried.signal == signal) return &carried;
  }
  return nullptr;
}

bool has_torque_signals(const Recognition& recognition) {
  const auto has = [&](int signal) { return recognition.find(signal) != nullptr; };
  return has(kRates) && (has(kDuty) || has(kRequested) || has(kMotorCommand) || has(kRotorSpeed));
}

bool is_dead(const RawTopic& topic, const Carried& carried) {
  return std::all_of(carried.columns.begin(), carried.columns.end(), [&](int c) {
    if (c < 0) return true;
    const std::vector<double>& values = topic.columns[static_cast<std::size_t>(c)].values;
    return std::all_of(values.begin(), values.end(), [](double x) { return !std::isfinite(x) || x == 0; });
  });
}

bool is_unit_quaternion(const RawTopic& topic, const std::vector<int>& columns) {
  std::size_t unit = 0, count = 0;
  for (std::size_t i = 0; i < topic.time_s.size(); ++i) {
    double norm = 0;
    for (const int c : columns) norm += std::pow(topic.columns[static_cast<std::size_t>(c)].values[i], 2);
    count += std::isfinite(norm) ? 1 : 0;
    unit += std::abs(norm - 1) < 0.05 ? 1 : 0;
  }
  return count > 0 && 2 * unit >= count;
}

std::vector<double> continuous_signs(const RawTopic& topic, const std::vector<int>& columns) {
  std::vector<double> signs(topic.time_s.size(), 1), last(columns.size(), 0);
  for (std::size_t i = 0; i < signs.size(); ++i) {
    double dot = 0;
    for (std::size_t k = 0; k < columns.size(); ++k)
      dot += last[k] * topic.columns[static_cast<std::size_t>(columns[k])].values[i];
    if (dot < 0) signs[i] = -1;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const double part = topic.columns[static_cast<std::size_t>(columns[k])].values[i];
      if (std::isfinite(part)) last[k] = signs[i] * part;
    }
  }
  return signs;
}

Recognition recognise(const RawLog& log, const SignalMap& map) {
  Recognition found;
  if (map.empty()) {
    recognise_by_names(log, found);
    assign_by_evidence(log, found);
  } else {
    recognise_by_map(log, map, found);
  }
  // Angles that are redundant beside a quaternion must not cost records where they are missing.
  if (map.empty() && (found.find(kAttitude) != nullptr || found.find(kPackedAttitude) != nullptr)) {
    found.groups.erase(std::remove_if(found.groups.begin(), found.groups.end(),
                                      [](const Carried& carried) { return carried.signal == kEuler; }),
                       found.groups.end());
  }
  for (const int signal : {kRates, kForceBody, kForceWorld, kAccelerationWorld, kVelocity, kPosition}) {
    if (const Carried* const carried = found.find(signal)) found.clock = carried->topic;
  }
  return found;
}

SignalMap meaning_of(const RawLog& log, const Recognition& recognition) {
  SignalMap meaning;
  for (const RawTopic& topic : log.topics) {
    if (topic.clock.empty()) continue;
    const UnitFactor per_us{1e6 * topic.clock_unit_s};
    meaning.push_back({kTime, topic.clock, per_us, unit_of_factor(kTime, per_us)});
    break;
  }
  for (const Carried& carried : recognition.groups) {
    if (carried.signal == kAccelerationWorld) continue;
    const RawTopic& topic = log.topics[carried.topic];
    for (std::size_t k = 0; k < carried.size(); ++k) {
      if (carried.columns[k] < 0) continue;
      const std::string& name = topic.columns[static_cast<std::size_t>(carried.columns[k])].name;
      const bool is_ambiguous = std::any_of(log.topics.begin(), log.topics.end(), [&](const RawTopic& other) {
        return &other < &topic && other.find(name) != nullptr;
      });
      const int signal = carried.signal + static_cast<int>(k);
      UnitFactor factor = carried.factor;
      if (k < carried.sign.size()) factor.multiply *= carried.sign[k];
      meaning.push_back(
          {signal, is_ambiguous ? topic.name + ": " + name : name, factor, unit_of_factor(signal, factor),
           std::isfinite(carried.odds_bits)
               ? fmt::format("odds {:.0f} bits against {}", carried.odds_bits, carried.runner_up)
               : "by its name"});
    }
  }
  return meaning;
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

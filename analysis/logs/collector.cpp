#include "analysis/logs/collector.h"

#include <algorithm>
#include <cmath>

#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {

double seconds_per_unit(const std::vector<double>& clock) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < clock.size(); ++i) {
    if (clock[i] > clock[i - 1]) steps.push_back(clock[i] - clock[i - 1]);
  }
  constexpr double kSlowest_s = 0.5;
  const double step = median(steps);
  for (const double unit_s : {1.0, 1e-3, 1e-6}) {
    if (step * unit_s <= kSlowest_s) return unit_s;
  }
  return steps.empty() ? 1 : 1e-9;
}

int clock_by_name(const RawTopic& topic) {
  for (const char* const name :
       {"t",       "time",        "timestamp",    "time.s",       "time.ms",      "time.us",
        "time.ns", "timestamp.s", "timestamp.ms", "timestamp.us", "timestamp.ns", "t.s",
        "t.ms",    "t.us",        "t.ns",         "date.time",    "datetime",     "sec",
        "secs",    "seconds",     "stamp",        "header.stamp", "time.sec",     "rosbag.timestamp"}) {
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      if (plain_name(topic.columns[c].name) == name) return static_cast<int>(c);
    }
  }
  return -1;
}

void Collector::begin(const std::vector<std::string>& names) {
  log_.topics.emplace_back();
  RawTopic& topic = log_.topics.back();
  for (const std::string& name : names) topic.columns.push_back({name, "", {}});
  const Carried stated = time_column(topic, map_);
  int clock = stated.columns[0];
  if (clock >= 0)
    scale_s_ = 1e-6 * stated.multiply / stated.divide;
  else if (map_.empty())
    clock = clock_by_name(topic);
  if (clock < 0) {
    throw files::InputError({log_.path, "line 1", "time", "", "no column carries it",
                             "log it, or name its column in a columns.toml (--columns)"});
  }
  time_ = static_cast<std::size_t>(clock);
  needs_.assign(names.size(), 0);
  needs_[time_] = 1;
  for (const Carried& carried : recognise(log_, map_).groups) {
    for (const int column : carried.columns) {
      if (column >= 0) needs_[static_cast<std::size_t>(column)] = 1;
    }
  }
}

void Collector::record(const std::vector<double>& values) {
  RawTopic& topic = log_.topics.back();
  for (std::size_t c = 0; c < values.size(); ++c) topic.columns[c].values.push_back(values[c]);
}

void Collector::end() {
  RawTopic& topic = log_.topics.back();
  const std::vector<double>& clock = topic.columns[time_].values;
  const double scale_s = scale_s_ > 0 ? scale_s_ : seconds_per_unit(clock);
  topic.time_s.reserve(clock.size());
  for (const double time : clock) topic.time_s.push_back(time * scale_s);
}

}  // namespace swarmcert::logs

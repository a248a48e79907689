#include "analysis/logs/collector.h"

#include <algorithm>
#include <cmath>
#include <map>

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
        "secs",    "seconds",     "stamp",        "header.stamp", "time.sec",     "rosbag.timestamp",
        "tick"}) {
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      if (plain_name(topic.columns[c].name) == name) return static_cast<int>(c);
    }
  }
  return -1;
}

int clock_by_steps(const RawTopic& topic) {
  int best = -1;
  double least = INFINITY;
  for (std::size_t c = 0; c < topic.columns.size(); ++c) {
    const std::vector<double>& values = topic.columns[c].values;
    std::vector<double> steps;
    for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
    const double step = median(steps);
    if (steps.size() < 10 || !(step > 0) || !(quantile_of(steps, 0.01) > 0)) continue;
    // A constant step of exactly one means a record counter; a clock has another unit or some jitter.
    double spread = (quantile_of(steps, 0.9) - quantile_of(steps, 0.1)) / step;
    if (step == 1 && spread == 0) spread = 1;
    if (spread > 1 || spread >= least) continue;
    least = spread;
    best = static_cast<int>(c);
  }
  return best;
}

void separate_blocks(RawLog& log) {
  constexpr double kWhole = 0.9;
  constexpr std::size_t kFew = 20;  // too few to tell blocks from damage
  RawTopic& joined = log.topics.back();
  const auto has_time = [&](std::size_t i) { return std::isfinite(joined.time_s[i]); };
  std::size_t records = 0;
  for (std::size_t i = 0; i < joined.time_s.size(); ++i) records += has_time(i) ? 1 : 0;
  if (records < kFew) return;
  std::map<std::vector<bool>, RawTopic> blocks;  // by the records that have numbers
  std::vector<RawColumn> whole;
  for (RawColumn& column : joined.columns) {
    std::vector<bool> has_number;
    for (std::size_t i = 0; i < joined.time_s.size(); ++i)
      has_number.push_back(has_time(i) && std::isfinite(column.values[i]));
    const auto count = static_cast<std::size_t>(std::count(has_number.begin(), has_number.end(), true));
    if (count == 0 || static_cast<double>(count) > kWhole * static_cast<double>(records)) {
      whole.push_back(std::move(column));
      continue;
    }
    RawTopic& block = blocks[has_number];
    const bool is_first = block.columns.empty();
    block.columns.push_back({column.name, column.unit, {}});
    for (std::size_t i = 0; i < has_number.size(); ++i) {
      if (!has_number[i]) continue;
      block.columns.back().values.push_back(column.values[i]);
      if (is_first) block.time_s.push_back(joined.time_s[i]);
    }
  }
  joined.columns = std::move(whole);
  const std::string name = joined.name + (joined.name.empty() ? "block " : " block ");
  for (auto& [has_number, block] : blocks) {
    block.name = name + std::to_string(log.topics.size());
    log.topics.push_back(std::move(block));
  }
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
  if (log_.format == "usd") scale_s_ = 1e-6;  // the ticks of the deck
  if (clock < 0 && !map_.empty()) refuse_without_clock();
  needs_.assign(names.size(), 0);
  has_clock_ = clock >= 0;
  if (has_clock_) time_ = static_cast<std::size_t>(clock);
  if (has_clock_) needs_[time_] = 1;
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

void Collector::refuse_without_clock() const {
  throw files::InputError({log_.path, "line 1", "time", "", "no column carries it",
                           "log it, or name its column in a columns.toml (--columns)"});
}

void Collector::end() {
  RawTopic& topic = log_.topics.back();
  if (!has_clock_) {
    const int clock = clock_by_steps(topic);
    if (clock < 0) refuse_without_clock();
    time_ = static_cast<std::size_t>(clock);
  }
  const std::vector<double>& clock = topic.columns[time_].values;
  const double scale_s = scale_s_ > 0 ? scale_s_ : seconds_per_unit(clock);
  topic.time_s.reserve(clock.size());
  for (const double time : clock) topic.time_s.push_back(time * scale_s);
  const std::string name = topic.columns[time_].name;
  separate_blocks(log_);
  const std::vector<RawColumn>& left = log_.topics.front().columns;  // that of the time among them
  const auto same = [&name](const RawColumn& column) { return column.name == name; };
  time_ = static_cast<std::size_t>(std::find_if(left.begin(), left.end(), same) - left.begin());
}

}  // namespace swarmcert::logs

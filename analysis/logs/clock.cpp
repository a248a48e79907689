#include "analysis/logs/clock.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "analysis/logs/column_names.h"
#include "analysis/logs/dictionary.h"
#include "analysis/logs/message_frames.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

/// Start of GPS time, and its lead over UTC since 2017.
constexpr double kReceiverEpoch_s = 315964800, kLeap_s = 18, kWeek_s = 604800;

/// Returns the time since 1970 of each record of a receiver topic, 0 where it had none; empty for other topics.
std::vector<double> receiver_times_s(const RawTopic& topic) {
  std::vector<double> times_s;
  for (const NamedColumns& row : column_names()) {
    if (row.signal != kTime || row.message.empty() || row.message != message_of(topic)) continue;
    const RawColumn *const time = topic.find(row.names.back()), *const week = topic.find(row.names[0]);
    if (time == nullptr || week == nullptr) continue;
    for (const double value : time->values)
      times_s.push_back(1e-6 * value * row.factor.multiply / row.factor.divide);
    for (std::size_t i = 0; row.names.size() > 1 && i < times_s.size(); ++i)
      times_s[i] =
          week->values[i] > 0 ? kReceiverEpoch_s - kLeap_s + kWeek_s * week->values[i] + times_s[i] : 0;
    break;
  }
  return times_s;
}

using Order = std::vector<std::size_t>;

/// Undoes wraps of counters and of times of day: where a clock falls by its range, up to a pause, it has wrapped.
/// @return number of wraps
std::size_t unwrap_clock(std::vector<double>& time_s) {
  constexpr double kLongestPause_s = 10;
  // Microseconds in 32 bits, milliseconds in 24 and 32 bits, the end of daylight saving time, midnight.
  struct Range {
    double size_s;
    int times = 0;
  };
  Range ranges[] = {{4294.967296}, {16777.216}, {4294967.296}, {3600}, {86400}};
  std::size_t wraps = 0;
  double added_s = 0, last_s = NAN;
  for (double& now_s : time_s) {
    const double step_s = now_s - last_s;
    for (Range& range : ranges) {
      if (step_s < 0 && std::abs(step_s + range.size_s) < kLongestPause_s) {
        added_s += range.size_s;
        ++range.times;
        ++wraps;
      } else if (range.times > 0 && step_s > 0 && std::abs(step_s - range.size_s) < kLongestPause_s) {
        added_s -= range.size_s;  // a record from before the wrap, out of order
        --range.times;
      }
    }
    if (std::isfinite(now_s)) last_s = now_s;
    now_s += added_s;
  }
  return wraps;
}

bool are_same(const RawTopic& topic, std::size_t a, std::size_t b) {
  return topic.time_s[a] == topic.time_s[b] &&
         std::all_of(topic.columns.begin(), topic.columns.end(), [&](const RawColumn& column) {
           const double x = column.values[a], y = column.values[b];
           return x == y || (std::isnan(x) && std::isnan(y));
         });
}

/// Returns true if a long run of rising times covers the same time as the long run before it.
bool starts_again(const std::vector<double>& time_s, const Order& order) {
  constexpr std::size_t kLong = 20;
  double first_s = INFINITY, last_s = INFINITY;  // of the long run before
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && time_s[order[end]] > time_s[order[end - 1]]) ++end;
    if (end - begin >= kLong) {
      const double from_s = time_s[order[begin]], to_s = time_s[order[end - 1]];
      const double common_s = std::min(to_s, last_s) - std::max(from_s, first_s);
      if (common_s > 0.5 * std::min(to_s - from_s, last_s - first_s)) return true;
      first_s = from_s;
      last_s = to_s;
    }
    begin = end;
  }
  return false;
}

[[noreturn]] void refuse_without_clock(const RawLog& log) {
  throw files::InputError({log.path, "line 1", "time", "", "no column carries it",
                           "log it, or name its column in a columns.toml (--columns)"});
}

/// @param stated_s the unit that the name states, believed if it gives a plausible logging rate; 0: none
double seconds_per_unit(std::vector<double> clock, double stated_s) {
  clock.erase(std::remove_if(clock.begin(), clock.end(), [](double t) { return !std::isfinite(t); }),
              clock.end());
  std::sort(clock.begin(), clock.end());  // rows may be in any order
  std::vector<double> steps = steps_of(clock);
  steps.erase(std::remove(steps.begin(), steps.end(), 0.0), steps.end());
  constexpr double kSlowest_s = 0.5, kFastest_s = 1e-5;
  const double step = median(steps);
  for (const double unit_s : {stated_s, 1.0, 1e-3, 1e-6}) {
    if (step * unit_s <= kSlowest_s && step * unit_s >= (unit_s == stated_s ? kFastest_s : 0)) return unit_s;
  }
  return steps.empty() ? 1 : 1e-9;
}

int clock_by_steps(const RawTopic& topic) {
  int best = -1;
  double least = INFINITY;
  for (std::size_t c = 0; c < topic.columns.size(); ++c) {
    const std::vector<double> steps = steps_of(topic.columns[c].values);
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
  // Records of which only other blocks have numbers are dropped.
  std::vector<char> here(joined.time_s.size(), 0), elsewhere = here;
  for (RawColumn& column : joined.columns) {
    std::vector<bool> has_number;
    for (std::size_t i = 0; i < joined.time_s.size(); ++i)
      has_number.push_back(has_time(i) && std::isfinite(column.values[i]));
    const auto count = static_cast<std::size_t>(std::count(has_number.begin(), has_number.end(), true));
    const bool is_whole = count == 0 || static_cast<double>(count) > kWhole * static_cast<double>(records);
    for (std::size_t i = 0; i < has_number.size(); ++i)
      if (has_number[i] && column.name != joined.clock) (is_whole ? here : elsewhere)[i] = 1;
    if (is_whole) {
      whole.push_back(std::move(column));
      continue;
    }
    RawTopic& block = blocks[has_number];
    const bool is_first = block.columns.empty();
    block.columns.push_back({column.name, {}});
    for (std::size_t i = 0; i < has_number.size(); ++i) {
      if (!has_number[i]) continue;
      block.columns.back().values.push_back(column.values[i]);
      if (is_first) block.time_s.push_back(joined.time_s[i]);
    }
  }
  joined.columns = std::move(whole);
  Order kept;
  for (std::size_t i = 0; i < here.size(); ++i)
    if (here[i] != 0 || elsewhere[i] == 0) kept.push_back(i);
  keep_records(joined, kept);
  log.health.repaired.merged_blocks += blocks.size();
  const std::string name = joined.name + (joined.name.empty() ? "block " : " block ");
  for (auto& [has_number, block] : blocks) {
    block.name = name + std::to_string(log.topics.size());
    log.topics.push_back(std::move(block));
  }
}

}  // namespace

int clock_by_name(const RawTopic& topic) {
  for (const std::string& name : words_of_kind("clock")) {
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      if (stated_unit(topic.columns[c].name, true).plain == name) return static_cast<int>(c);
    }
  }
  return -1;
}

std::optional<Clock> stated_clock(const RawLog& log, const SignalMap& map) {
  const RawTopic& topic = log.topics.back();
  std::optional<Clock> clock;
  const auto find = [&](const std::string& name, double unit_s) {
    const RawColumn* const column = topic.find(name);
    if (column != nullptr && !clock)
      clock = {static_cast<std::size_t>(column - topic.columns.data()), unit_s};
  };
  for (const SignalSource& source : map)
    if (source.signal == kTime) find(source.column, 1e-6 * source.factor.scale());
  for (const NamedColumns& row : column_names())
    if (map.empty() && row.signal == kTime && row.message.empty())
      find(row.names[0], 1e-6 * row.factor.scale());
  const int named = map.empty() ? clock_by_name(topic) : -1;
  if (!clock && named >= 0) clock = {static_cast<std::size_t>(named), 0};
  if (!clock && !map.empty()) refuse_without_clock(log);
  return clock;
}

void set_times(RawLog& log, std::optional<Clock> clock) {
  RawTopic& topic = log.topics.back();
  if (!clock) {
    const int steady = clock_by_steps(topic);
    if (steady < 0) refuse_without_clock(log);
    clock = {static_cast<std::size_t>(steady), 0};
  }
  const RawColumn& column = topic.columns[clock->column];
  const std::string unit = stated_unit(column.name, true).unit;
  const double stated_s = unit.empty() ? 0 : 1e-6 * unit_factor(kTime, unit)->scale();
  topic.clock = column.name;
  topic.clock_unit_s = log.format == "usd" ? 1e-6  // the ticks of the deck
                       : clock->unit_s > 0 ? clock->unit_s
                                           : seconds_per_unit(column.values, stated_s);
  for (const double time : column.values) topic.time_s.push_back(time * topic.clock_unit_s);
  separate_blocks(log);
}

void keep_records(RawTopic& topic, const std::vector<std::size_t>& order) {
  const auto keep = [&order](std::vector<double>& values) {
    std::vector<double> kept;
    kept.reserve(order.size());
    for (const std::size_t i : order) kept.push_back(values[i]);
    values = std::move(kept);
  };
  for (RawColumn& column : topic.columns) keep(column.values);
  keep(topic.time_s);
}

Repaired put_in_order(RawTopic& topic) {
  Repaired repaired;
  std::vector<double>& time_s = topic.time_s;
  repaired.unwrapped_clocks = unwrap_clock(time_s);
  const bool is_rising = std::adjacent_find(time_s.begin(), time_s.end(),
                                            [](double a, double b) { return !(a < b); }) == time_s.end();
  if (is_rising) return repaired;
  Order order(time_s.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::isfinite(time_s[a]) && (!std::isfinite(time_s[b]) || time_s[a] < time_s[b]);
  });
  Order kept;
  for (const std::size_t i : order) {
    if (kept.empty() || !are_same(topic, kept.back(), i)) kept.push_back(i);
  }
  repaired.repeated_rows = order.size() - kept.size();
  Order in_file = kept;
  std::sort(in_file.begin(), in_file.end());
  if (starts_again(time_s, in_file)) {
    kept = std::move(in_file);
  } else {
    double latest_s = -INFINITY;
    for (const std::size_t i : in_file) {
      repaired.unsorted_rows += time_s[i] < latest_s ? 1 : 0;
      if (std::isfinite(time_s[i])) latest_s = std::max(latest_s, time_s[i]);
    }
  }
  keep_records(topic, kept);
  return repaired;
}

double receiver_offset_s(const RawLog& log) {
  std::vector<double> offsets_s;
  for (const RawTopic& topic : log.topics) {
    const std::vector<double> utc_s = receiver_times_s(topic);
    for (std::size_t i = 0; i < std::min(utc_s.size(), topic.time_s.size()); ++i) {
      if (utc_s[i] > kAbsoluteClock_s) offsets_s.push_back(utc_s[i] - topic.time_s[i]);
    }
  }
  return offsets_s.empty() ? 0 : median(offsets_s);
}

Interval absolute_span_s(const RawLog& log) {
  double first_s = INFINITY, last_s = -INFINITY;
  for (const RawTopic& topic : log.topics) {
    first_s = std::min(first_s, quantile_of(topic.time_s, 0));
    last_s = std::max(last_s, quantile_of(topic.time_s, 1));
  }
  if (!(last_s > first_s)) return {0, 0};
  if (first_s > kAbsoluteClock_s) return {first_s, last_s};
  const double offset_s = receiver_offset_s(log);
  if (!(offset_s > 0)) return {0, 0};
  return {first_s + offset_s, last_s + offset_s};
}

}  // namespace swarmcert::logs

#include "analysis/logs/clock.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/logs/column_names.h"
#include "analysis/logs/dictionary.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

[[noreturn]] void refuse_without_clock(const RawLog& log) {
  throw files::InputError({log.path, "line 1", "time", "", "no column carries it",
                           "log it, or name its column in a columns.toml (--columns)"});
}

double seconds_per_unit(std::vector<double> clock) {
  clock.erase(std::remove_if(clock.begin(), clock.end(), [](double t) { return !std::isfinite(t); }),
              clock.end());
  std::sort(clock.begin(), clock.end());  // rows may be in any order
  std::vector<double> steps = steps_of(clock);
  steps.erase(std::remove(steps.begin(), steps.end(), 0.0), steps.end());
  constexpr double kSlowest_s = 0.5;
  const double step = median(steps);
  for (const double unit_s : {1.0, 1e-3, 1e-6}) {
    if (step * unit_s <= kSlowest_s) return unit_s;
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

/// Drops the records of which only other blocks have numbers.
void drop_records_of_others(RawTopic& topic, const std::map<std::vector<bool>, RawTopic>& blocks) {
  if (blocks.empty()) return;
  const std::size_t n = topic.time_s.size();
  std::vector<char> numbers(n, 0), others(n, 0);
  for (const RawColumn& column : topic.columns) {
    if (column.name == topic.clock) continue;
    for (std::size_t i = 0; i < n; ++i)
      if (std::isfinite(column.values[i])) numbers[i] = 1;
  }
  for (const auto& [has_number, block] : blocks)
    for (std::size_t i = 0; i < n; ++i)
      if (has_number[i]) others[i] = 1;
  const auto keep = [&](std::vector<double>& values) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (numbers[i] != 0 || others[i] == 0) values[kept++] = values[i];
    values.resize(kept);
  };
  for (RawColumn& column : topic.columns) keep(column.values);
  keep(topic.time_s);
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
  drop_records_of_others(joined, blocks);
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
      if (plain_name(topic.columns[c].name) == name) return static_cast<int>(c);
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
    if (source.signal == kTime) find(source.column, 1e-6 * source.multiply / source.divide);
  if (map.empty()) {
    // "time[ms]" of the published CSV files is in microseconds.
    for (const char* const name : {"time_us", "time[ms]"}) find(name, 1e-6);
    const int named = clock_by_name(topic);
    if (!clock && named >= 0) clock = {static_cast<std::size_t>(named), 0};
  }
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
  topic.clock = column.name;
  topic.clock_unit_s = log.format == "usd" ? 1e-6  // the ticks of the deck
                       : clock->unit_s > 0 ? clock->unit_s
                                           : seconds_per_unit(column.values);
  for (const double time : column.values) topic.time_s.push_back(time * topic.clock_unit_s);
  separate_blocks(log);
}

}  // namespace swarmcert::logs

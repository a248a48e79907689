#include "analysis/logs/record_order.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace swarmcert::logs {
namespace {

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

void rearrange(std::vector<double>& values, const Order& order) {
  std::vector<double> rearranged;
  rearranged.reserve(order.size());
  for (const std::size_t i : order) rearranged.push_back(values[i]);
  values = std::move(rearranged);
}

}  // namespace

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
  for (RawColumn& column : topic.columns) rearrange(column.values, kept);
  rearrange(time_s, kept);
  return repaired;
}

}  // namespace swarmcert::logs

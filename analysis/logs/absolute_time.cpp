#include "analysis/logs/absolute_time.h"

#include <algorithm>
#include <cmath>

#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

/// Start of GPS time, and its lead over UTC since 2017.
constexpr double kReceiverEpoch_s = 315964800, kLeap_s = 18, kWeek_s = 604800;

/// Returns the time since 1970 of each record of a receiver topic, 0 where it had none; empty for other topics.
std::vector<double> receiver_times_s(const RawTopic& topic) {
  std::vector<double> times_s;
  if (const RawColumn* const utc = topic.find("time_utc_usec")) {
    for (const double us : utc->values) times_s.push_back(1e-6 * us);
    return times_s;
  }
  const RawColumn *const week = topic.find("GWk"), *const ms = topic.find("GMS");
  if (topic.name.rfind("GPS", 0) != 0 || week == nullptr || ms == nullptr) return times_s;
  for (std::size_t i = 0; i < std::min(week->values.size(), ms->values.size()); ++i) {
    const bool has_time = week->values[i] > 0;
    times_s.push_back(has_time ? kReceiverEpoch_s - kLeap_s + kWeek_s * week->values[i] + 1e-3 * ms->values[i]
                               : 0);
  }
  return times_s;
}

}  // namespace

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
    for (const double time_s : topic.time_s) {
      if (!std::isfinite(time_s)) continue;
      first_s = std::min(first_s, time_s);
      last_s = std::max(last_s, time_s);
    }
  }
  if (!(last_s > first_s)) return {0, 0};
  if (first_s > kAbsoluteClock_s) return {first_s, last_s};
  const double offset_s = receiver_offset_s(log);
  if (!(offset_s > 0)) return {0, 0};
  return {first_s + offset_s, last_s + offset_s};
}

}  // namespace swarmcert::logs

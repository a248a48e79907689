#include "analysis/logs/signal_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/logs/statistics_of_series.h"
#include "nn/base/median.h"
#include "nn/base/pi.h"

namespace swarmcert::logs {
namespace {

constexpr double kLongestPause_us = 10e6;
constexpr double kInt16Range = 65536;

double median_step(const std::vector<double>& times) { return upper_median(steps_of(times)); }

/// Undoes wraps of positions stored as 16-bit integers, where neighbours differ by almost the whole range. (Velocities
/// and accelerations may jump that far in a crash.) Values that stay at the ends of the range are reported.
std::vector<double> without_wraps(const RawColumn& column, const std::vector<double>& time_s,
                                  bool is_position, std::vector<LogEvent>& events) {
  constexpr double kJump = 0.9 * kInt16Range;
  constexpr std::size_t kMostEvents = 20;
  const std::vector<double>& stored = column.values;
  const bool integers = std::all_of(stored.begin(), stored.end(), [](double x) {
    return std::abs(x) <= kInt16Range / 2 && x == std::floor(x);
  });
  if (!integers) return stored;
  std::vector<double> values = stored;
  double turns = 0, last = kNaN;
  std::size_t wraps = 0, saturated = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double now = stored[i];
    if (is_position && std::abs(now - last) > kJump) {
      turns += now < last ? 1 : -1;
      if (++wraps <= kMostEvents)
        events.push_back({"wrap", time_s[i], 0, column.name + ": a 16-bit integer"});
    }
    const bool full = now == kInt16Range / 2 - 1 || now == -kInt16Range / 2;
    if (full && now == last && ++saturated <= kMostEvents)
      events.push_back(
          {"saturation", time_s[i], 0, column.name + ": a 16-bit integer at the limit of its range"});
    last = now;
    values[i] = now + turns * kInt16Range;
  }
  return values;
}

struct Series {
  std::vector<double> time_s, values;
};

/// Drops what is not finite and times that do not rise.
Series rising(const std::vector<double>& time_s, const std::vector<double>& values) {
  Series series;
  for (std::size_t i = 0; i < std::min(time_s.size(), values.size()); ++i) {
    if (!std::isfinite(time_s[i]) || !std::isfinite(values[i])) continue;
    if (!series.time_s.empty() && time_s[i] <= series.time_s.back()) continue;
    series.time_s.push_back(time_s[i]);
    series.values.push_back(values[i]);
  }
  return series;
}

/// Returns the times of a topic in microseconds. Files store whole micro- or nanoseconds: the rounding of their
/// conversion to seconds is undone.
std::vector<double> times_us(const RawTopic& topic) {
  std::vector<double> times;
  times.reserve(topic.time_s.size());
  for (const double time_s : topic.time_s) {
    const double time_us = 1e6 * time_s, whole_us = std::nearbyint(time_us);
    times.push_back(std::abs(time_us - whole_us) < 1e-3 ? whole_us : time_us);
  }
  return times;
}

/// Selects the records that are kept, and sets the times of the table.
/// @param candidates whose signals are finite
/// @param longest_s step that is no gap
std::vector<std::size_t> kept_records(const std::vector<double>& clock_us,
                                      const std::vector<std::size_t>& candidates, double longest_s,
                                      SignalTable& table, LogHealth& health) {
  const auto follows = [](double step_us) { return step_us > 0 && step_us <= kLongestPause_us; };
  std::vector<std::size_t> kept;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const double now = clock_us[candidates[c]];
    if (kept.size() == 1 && now <= clock_us[kept[0]]) {  // the first record was the outlier
      kept.clear();
      ++health.clock_jumps;
    }
    const double step_us = kept.empty() ? 1 : now - clock_us[kept.back()];
    const bool is_confirmed =
        step_us > 0 && c + 1 < candidates.size() && follows(clock_us[candidates[c + 1]] - now);
    if (follows(step_us) || is_confirmed)
      kept.push_back(candidates[c]);
    else
      ++health.clock_jumps;
  }
  for (const std::size_t record : kept) {
    const double now = clock_us[record];
    const double pause_s = table.time_us.empty() ? INFINITY : 1e-6 * (now - table.time_us.back());
    table.restarts.push_back(pause_s > longest_s ? 1 : 0);
    if (pause_s > longest_s && std::isfinite(pause_s)) {
      ++health.gaps;
      health.longest_gap_s = std::max(health.longest_gap_s, pause_s);
    }
    table.time_us.push_back(now);
  }
  health.records = kept.size();
  return kept;
}

/// Quaternions without unit norm are no rotations.
void drop_bad_quaternions(std::array<std::vector<double>, kNumSignals>& all) {
  if (all[kAttitude].empty() || !all[kPackedAttitude].empty()) return;
  for (std::size_t i = 0; i < all[kAttitude].size(); ++i) {
    double norm = 0;
    for (std::size_t k = kAttitude; k < kAttitude + 4; ++k)
      norm += all[k].empty() ? 0 : all[k][i] * all[k][i];
    if (!(std::abs(norm - 1) < 0.05)) all[kAttitude][i] = kNaN;
  }
}

/// Resamples `series` at `times_s`: means over a target step where the series is faster, linear interpolation
/// elsewhere, NaN across gaps. Both clocks must ascend.
/// @param hold  keep values across gaps and beyond the ends, e.g. for a battery voltage
std::vector<double> resampled(const std::vector<double>& from_s, const std::vector<double>& series,
                              const std::vector<double>& times_s, bool hold) {
  const Series source = rising(from_s, series);
  std::vector<double> values(times_s.size(), kNaN);
  if (source.time_s.empty()) return values;
  const double step_s = median_step(source.time_s), own_step_s = median_step(times_s);
  const double longest_s = std::max(kLongestGap_s, 3 * step_s);
  const bool averages = own_step_s > 1.5 * step_s;
  const auto begin = source.time_s.begin();
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double now = times_s[i];
    const auto after = static_cast<std::size_t>(std::lower_bound(begin, source.time_s.end(), now) - begin);
    if (averages) {
      const auto first = static_cast<std::size_t>(
          std::lower_bound(begin, source.time_s.end(), now - own_step_s / 2) - begin);
      double sum = 0;
      std::size_t k = first;
      for (; k < source.time_s.size() && source.time_s[k] < now + own_step_s / 2; ++k)
        sum += source.values[k];
      if (k > first) {
        values[i] = sum / static_cast<double>(k - first);
        continue;
      }
    }
    const bool has_after = after<source.time_s.size(), has_before = after> 0;
    if (has_after && source.time_s[after] == now) {
      values[i] = source.values[after];
    } else if (has_after && has_before &&
               (hold || source.time_s[after] - source.time_s[after - 1] <= longest_s)) {
      const double t0 = source.time_s[after - 1], t1 = source.time_s[after];
      values[i] = source.values[after - 1] +
                  (now - t0) / (t1 - t0) * (source.values[after] - source.values[after - 1]);
    } else if (has_after && (hold || source.time_s[after] - now <= longest_s)) {
      values[i] = source.values[after];
    } else if (has_before && (hold || now - source.time_s[after - 1] <= longest_s)) {
      values[i] = source.values[after - 1];
    }
  }
  return values;
}

/// Returns true for signals without which a record is useless, if the log has them.
bool is_needed(int signal) {
  return signal < kRates || (signal >= kDuty && signal < kTargetPosition) ||
         (signal >= kEuler && signal < kRequested);
}

}  // namespace

void unwrap(std::vector<double>& angles_rad) {
  double last = kNaN;
  for (double& angle : angles_rad) {
    if (std::isfinite(angle - last)) angle -= 2 * kPi * std::round((angle - last) / (2 * kPi));
    if (std::isfinite(angle)) last = angle;
  }
}

double longest_gap_s(double step_s) { return std::max(kLongestGap_s, step_s > 0.02 ? 2.5 * step_s : 0); }

double SignalTable::step_s() const { return 1e-6 * median_step(time_us); }

SignalTable signal_table(const RawLog& log, const Recognition& recognition, LogHealth& health,
                         std::vector<LogEvent>& events) {
  SignalTable table;
  if (log.topics.empty()) return table;
  const RawTopic& clock = log.topics[recognition.clock];
  const std::vector<double> clock_us = times_us(clock);
  std::vector<double> clock_s;
  for (const double time_us : clock_us) clock_s.push_back(1e-6 * time_us);
  std::array<std::vector<double>, kNumSignals> all;
  std::array<char, kNumSignals> is_own{};  // carried by the topic of the clock
  for (const Carried& carried : recognition.groups) {
    const RawTopic& topic = log.topics[carried.topic];
    std::vector<double> topic_s;
    if (carried.topic != recognition.clock) {
      for (const double time_us : times_us(topic)) topic_s.push_back(1e-6 * time_us);
    }
    std::vector<double> signs;
    if (carried.topic != recognition.clock && carried.signal == kAttitude && carried.size() == 4)
      signs = continuous_signs(topic, carried.columns);
    for (std::size_t k = 0; k < carried.size(); ++k) {
      if (carried.columns[k] < 0) continue;
      const RawColumn& column = topic.columns[static_cast<std::size_t>(carried.columns[k])];
      std::vector<double> values =
          carried.factor.divide == 1000
              ? without_wraps(column, topic.time_s,
                              carried.signal == kPosition || carried.signal == kTargetPosition, events)
              : column.values;
      const double sign = k < carried.sign.size() ? carried.sign[k] : 1;
      const UnitFactor& factor = carried.factor;
      for (double& value : values) {
        value = sign * (value - factor.offset) * factor.multiply / factor.divide;
        // Pulses of a servo signal go beyond the ends of its range.
        if (factor.offset != 0 && std::isfinite(value)) value = std::clamp(value, 0.0, 1.0);
      }
      for (std::size_t i = 0; i < signs.size(); ++i) values[i] *= signs[i];
      const int signal = carried.signal + static_cast<int>(k);
      if (carried.topic != recognition.clock) {
        if (carried.signal == kEuler) unwrap(values);
        values = resampled(topic_s, values, clock_s, signal == kBattery);
      }
      all[static_cast<std::size_t>(signal)] = std::move(values);
      is_own[static_cast<std::size_t>(signal)] = carried.topic == recognition.clock ? 1 : 0;
    }
  }
  drop_bad_quaternions(all);
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < clock_us.size(); ++i) {
    bool is_finite = true, others_know = true;
    for (int signal = 0; signal < kNumSignals; ++signal) {
      const auto k = static_cast<std::size_t>(signal);
      if (all[k].empty() || !is_needed(signal) || std::isfinite(all[k][i])) continue;
      (is_own[k] != 0 ? is_finite : others_know) = false;
    }
    if (!others_know && is_finite)
      continue;  // another topic has not begun, has ended or has a gap: not damage
    if (is_finite && std::isfinite(clock_us[i]))
      candidates.push_back(i);
    else
      ++health.not_finite;
  }
  const std::vector<std::size_t> kept =
      kept_records(clock_us, candidates, longest_gap_s(median_step(clock_s)), table, health);
  for (std::size_t s = 0; s < all.size(); ++s) {
    if (all[s].empty()) continue;
    table.values[s].reserve(kept.size());
    for (const std::size_t i : kept) table.values[s].push_back(all[s][i]);
    all[s] = {};
  }
  return table;
}

}  // namespace swarmcert::logs

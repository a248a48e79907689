#include "analysis/logs/motion_knots.h"

#include <algorithm>
#include <cmath>

#include "analysis/logs/column_groups.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {

double Knots::independent(std::size_t count) const {
  constexpr double kMemory_s = 0.2;  // of a vehicle's motion
  return static_cast<double>(count) * std::min(1.0, step_s / kMemory_s);
}

Knots knots_of(const RawLog& log) {
  const RawTopic* longest = nullptr;
  for (const RawTopic& topic : log.topics) {
    if (!is_plain_table(log, topic)) continue;
    if (longest == nullptr || topic.time_s.size() > longest->time_s.size()) longest = &topic;
  }
  Knots knots;
  if (longest == nullptr || longest->time_s.size() < 8) return knots;
  std::vector<double> steps = steps_of(longest->time_s);
  steps.erase(std::remove_if(steps.begin(), steps.end(), [](double step) { return !(step > 0); }),
              steps.end());
  const double first = quantile_of(longest->time_s, 0), last = quantile_of(longest->time_s, 1);
  const double step = median(steps);
  if (!(step > 0)) return knots;
  knots.window_s = std::max(0.1, 4.01 * step);
  knots.step_s = knots.window_s / 2;
  const double most_s = knots.step_s * static_cast<double>(Knots::kMost - 1);
  // The middle of a long log is flight.
  double now = last - first > most_s ? (first + last - most_s) / 2 : first;
  for (; now <= last && knots.time_s.size() < Knots::kMost; now += knots.step_s) knots.time_s.push_back(now);
  return knots;
}

KnotSeries at_knots(const Knots& knots, const std::vector<double>& time_s,
                    const std::vector<double>& values) {
  KnotSeries series{std::vector<double>(knots.time_s.size(), kNaN),
                    std::vector<double>(knots.time_s.size(), kNaN)};
  std::size_t from = 0;
  for (std::size_t k = 0; k < knots.time_s.size(); ++k) {
    const double now = knots.time_s[k];
    while (from < time_s.size() && !(time_s[from] >= now - knots.window_s / 2)) ++from;
    double count = 0, st = 0, sx = 0, stt = 0, stx = 0;
    for (std::size_t i = from; i < time_s.size() && time_s[i] <= now + knots.window_s / 2; ++i) {
      if (!std::isfinite(values[i])) continue;
      const double t = time_s[i] - now;
      ++count;
      st += t, sx += values[i], stt += t * t, stx += t * values[i];
    }
    const double spread = count * stt - st * st;
    if (count < 3 || !(spread > 0)) continue;
    series.slope[k] = (count * stx - st * sx) / spread;
    series.value[k] = (sx - series.slope[k] * st) / count;
  }
  return series;
}

std::vector<double> difference_of(const Knots& knots, const std::vector<double>& series) {
  std::vector<double> difference(series.size(), kNaN);
  for (std::size_t i = 1; i + 1 < series.size(); ++i)
    difference[i] = (series[i + 1] - series[i - 1]) / (knots.time_s[i + 1] - knots.time_s[i - 1]);
  return difference;
}

}  // namespace swarmcert::logs

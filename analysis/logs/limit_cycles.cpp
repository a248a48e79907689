#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "analysis/logs/flight_story.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/pi.h"

namespace swarmcert::logs {
namespace {

constexpr double kLeastTilt_rad = 0.1, kLeast_hz = 1, kSamePeriod = 0.3;
constexpr std::size_t kLeastPeriods = 4;
/// An oscillation whose set point asks for this share of its tilt is an excitation.
constexpr double kAskedShare = 0.5;
/// Half the rate amplitude of a kLeastTilt_rad oscillation at kLeast_hz; smaller excursions are ignored.
constexpr double kLeastRate_rad_s = 0.5 * kLeastTilt_rad * 2 * kPi * kLeast_hz;

struct Period {
  double start_s = 0, length_s = 0;
  double tilt_rad = 0;   ///< amplitude of the angle
  bool follows = false;  ///< directly follows the previous period
};

/// Returns the records from `first` to `end` minus their running mean over 1 s, which removes what is slower than
/// kLeast_hz.
std::vector<double> fast_part(const Log& log, std::size_t first, std::size_t end, std::size_t axis) {
  const auto time_s = [&](std::size_t i) { return 1e-6 * log.samples[i].time_us; };
  std::vector<double> fast;
  std::size_t low = first, high = first;
  double sum = 0;
  for (std::size_t i = first; i < end; ++i) {
    while (high < end && time_s(high) <= time_s(i) + 0.5 / kLeast_hz)
      sum += log.samples[high++].rates_rad_s[axis];
    while (time_s(low) < time_s(i) - 0.5 / kLeast_hz) sum -= log.samples[low++].rates_rad_s[axis];
    fast.push_back(log.samples[i].rates_rad_s[axis] - sum / static_cast<double>(high - low));
  }
  return fast;
}

/// A period lasts from one upward zero crossing to the next, with an excursion to either side.
void add_periods(const Log& log, std::size_t first, std::size_t end, std::size_t axis,
                 std::vector<Period>& periods) {
  const std::vector<double> rate = fast_part(log, first, end, axis);
  double low = 0, high = 0, start_s = 0;
  bool open = false, follows = false;
  for (std::size_t k = 1; k < rate.size(); ++k) {
    low = std::min(low, rate[k]);
    high = std::max(high, rate[k]);
    const bool goes_up = rate[k - 1] < 0 && rate[k] >= 0 && low < -kLeastRate_rad_s;
    if (!goes_up || (open && high < kLeastRate_rad_s)) continue;
    const double now_s = 1e-6 * log.samples[first + k].time_us;
    if (open) {
      const double length_s = now_s - start_s;
      periods.push_back({start_s, length_s, 0.5 * (high - low) * length_s / (2 * kPi), follows});
      follows = true;
    }
    open = true;
    start_s = now_s;
    low = high = 0;
  }
}

/// Returns the end of the run of periods, starting at `first`, that belong to one oscillation.
std::size_t end_of_run(const std::vector<Period>& periods, std::size_t first) {
  std::vector<double> lengths_s;
  std::size_t end = first;
  for (; end < periods.size(); ++end) {
    const Period& period = periods[end];
    if (period.tilt_rad < kLeastTilt_rad || period.length_s > 1 / kLeast_hz) break;
    if (end > first && (!period.follows || std::abs(period.length_s / median(lengths_s) - 1) > kSamePeriod))
      break;
    lengths_s.push_back(period.length_s);
  }
  return end;
}

/// Returns the tilt that the set point asks for at one frequency: the amplitude of its acceleration over that of
/// gravity, along x or y. A Hann window leaves little of slower manoeuvres. 0 without set points.
double asked_tilt_rad(const Log& log, double start_s, double length_s, double hz) {
  if (!log.signals.targets) return 0;
  std::complex<double> sums[2];
  double weights = 0;
  for (const Sample& sample : log.samples) {
    const double t_s = 1e-6 * sample.time_us - start_s;
    const Vector& v = sample.target_velocity_m_s;
    if (t_s < 0 || t_s > length_s || !std::isfinite(v[0]) || !std::isfinite(v[1])) continue;
    const double weight = 1 - std::cos(2 * kPi * t_s / length_s);
    weights += weight;
    for (std::size_t k = 0; k < 2; ++k) sums[k] += weight * v[k] * std::polar(1.0, -2 * kPi * hz * t_s);
  }
  if (weights == 0) return 0;
  return 2 * kPi * hz * 2 * std::max(std::abs(sums[0]), std::abs(sums[1])) / weights / kGravity_m_s2;
}

void add_cycles(const Log& log, const std::vector<Period>& periods, const char* axis,
                std::vector<LogEvent>& events) {
  std::size_t first = 0;
  while (first < periods.size()) {
    const std::size_t end = end_of_run(periods, first);
    if (end - first >= kLeastPeriods) {
      double tilt_rad = 0;
      for (std::size_t k = first; k < end; ++k)
        tilt_rad += periods[k].tilt_rad / static_cast<double>(end - first);
      const double length_s = periods[end - 1].start_s + periods[end - 1].length_s - periods[first].start_s;
      const double hz = static_cast<double>(end - first) / length_s;
      if (asked_tilt_rad(log, periods[first].start_s, length_s, hz) < kAskedShare * tilt_rad)
        events.push_back({"limit cycle", periods[first].start_s, length_s,
                          fmt::format("{} periods of {} at {:.2g} Hz, {:.2g} degrees to either side",
                                      end - first, axis, hz, tilt_rad * 180 / kPi)});
    }
    first = std::max(end, first + 1);
  }
}

}  // namespace

std::vector<LogEvent> limit_cycles(const Log& log, const std::vector<char>& air) {
  std::vector<LogEvent> events;
  if (!log.signals.rates) return events;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::vector<Period> periods;
    std::size_t first = 0;
    for (std::size_t i = 0; i <= log.samples.size(); ++i) {
      const bool goes_on = i < log.samples.size() && air[i] != 0 && !(i > first && log.samples[i].restarts);
      if (goes_on) continue;
      add_periods(log, first, i, axis, periods);
      first = i < log.samples.size() && air[i] != 0 ? i : i + 1;
    }
    add_cycles(log, periods, axis == 0 ? "roll" : "pitch", events);
  }
  return events;
}

}  // namespace swarmcert::logs

#include "analysis/logs/plausibility.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "nn/base/median.h"

namespace swarmcert::logs {
namespace {

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector difference(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

bool is_near(double value, double expected) { return std::abs(value - expected) < 0.15 * std::abs(expected); }

/// Checks the steps between records and the records dropped by their time.
void check_time(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kShortest_s = 1e-4, kLongest_s = 0.5, kFewRecords = 20;
  const auto& samples = log.samples;
  const double dropped = static_cast<double>(log.health.clock_jumps),
               kept = static_cast<double>(samples.size());
  if (dropped > kFewRecords && dropped > 9 * kept) {
    doubts.push_back(
        {"time", dropped,
         fmt::format("time: {:g} of {:g} records are over 10 s apart or out of order; a smaller unit was "
                     "probably meant than the one that is declared (us, ms or s)",
                     dropped, dropped + kept),
         true});
    return;
  }
  if (kept < kFewRecords) return;
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < samples.size(); ++i)
    steps_s.push_back(1e-6 * (samples[i].time_us - samples[i - 1].time_us));
  const double step_s = upper_median(std::move(steps_s));
  if (step_s >= kShortest_s && step_s <= kLongest_s) return;
  doubts.push_back({"time", step_s,
                    fmt::format("time: records are {:.3g} s apart; {}", step_s,
                                step_s > kLongest_s ? "probably milliseconds declared as seconds"
                                                    : "probably seconds declared as milliseconds"),
                    true});
}

/// Returns the probable cause of a mean of `g` times gravity.
std::string force_guess(double g) {
  if (is_near(g, 1 / kGravity_m_s2)) return "the column is probably in g, not in m/s^2";
  if (is_near(g, kGravity_m_s2)) return "the column is probably in m/s^2, not in g";
  if (is_near(g, 1000)) return "the column is probably in mm/s^2, not in m/s^2";
  if (is_near(g, 2)) return "gravity is probably counted twice";
  if (is_near(g, -1)) return "its z axis probably points down";
  if (std::abs(g) < 0.05)
    return "it is probably an acceleration without gravity; a specific force has +1 g at rest";
  return "unit, sign or frame is wrong, or the sensor failed";
}

void check_specific_force(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kDoubt = 0.15, kRefusal = 0.5;  // of 1 g
  double sum = 0;
  for (const Sample& sample : log.samples) sum += sample.specific_force_m_s2[2];
  const double mean_m_s2 = sum / static_cast<double>(log.samples.size());
  const double g = mean_m_s2 / kGravity_m_s2;
  if (std::abs(g - 1) <= kDoubt) return;
  doubts.push_back(
      {"specific_force", mean_m_s2,
       fmt::format(
           "specific_force: {:.3g} m/s^2 upwards on average instead of the 9.81 of rest and flight; {}",
           mean_m_s2, force_guess(g)),
       std::abs(g - 1) > kRefusal});
}

void check_duty(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kTolerance = 0.01, kIdle = 0.05, kMoves_m = 0.2;
  double largest = -INFINITY, smallest = INFINITY;
  Vector low = log.samples[0].position_m, high = low;
  std::size_t outside = 0;
  for (const Sample& sample : log.samples) {
    const auto [least, most] = std::minmax_element(sample.duty.begin(), sample.duty.end());
    smallest = std::min(smallest, *least);
    largest = std::max(largest, *most);
    outside += *least < -kTolerance || *most > 1 + kTolerance ? 1 : 0;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], sample.position_m[k]);
      high[k] = std::max(high[k], sample.position_m[k]);
    }
  }
  if (outside > 0) {
    const char* const guess = largest > 2000  ? "counts of 0 .. 65535 were probably meant: unit = \"PWM\""
                              : largest > 101 ? "pulse lengths or counts of another range were probably meant"
                              : largest > 1.5 ? "percent was probably meant: divide by 100"
                                              : "a fraction of full power is between 0 and 1";
    doubts.push_back({"duty", largest > 1 + kTolerance ? largest : smallest,
                      fmt::format("duty: between {:.4g} and {:.4g}, in {} records outside of 0 .. 1; {}",
                                  smallest, largest, outside, guess),
                      largest > 1.5 || smallest < -0.5});
  } else if (largest < kIdle && norm(difference(high, low)) > kMoves_m) {
    doubts.push_back({"duty", largest,
                      fmt::format("duty: never above {:.3g} although the vehicle moves by {:.2f} m; probably "
                                  "fractions of 0 .. 1 or percent declared as PWM",
                                  largest, norm(difference(high, low))),
                      true});
  }
}

void check_battery(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kLargest_V = 100, kSmallest_V = 0.1;
  std::vector<double> volts;
  for (const Sample& sample : log.samples) volts.push_back(sample.battery_V);
  const double median_V = upper_median(std::move(volts));
  if (median_V <= kLargest_V && median_V >= kSmallest_V) return;
  doubts.push_back({"battery", median_V,
                    fmt::format("battery: {:.4g} V in the median; {}", median_V,
                                median_V > kLargest_V ? "probably millivolt declared as volt"
                                                      : "probably volt declared as millivolt"),
                    true});
}

/// Calls `use` with the first and last index of stretches of at least `least_s` without a gap.
void for_each_stretch(const Log& log, double least_s,
                      const std::function<void(std::size_t, std::size_t)>& use) {
  std::size_t first = 0;
  for (std::size_t i = 1; i < log.samples.size(); ++i) {
    if (log.samples[i].restarts) first = i;
    if (1e-6 * (log.samples[i].time_us - log.samples[first].time_us) < least_s) continue;
    use(first, i);
    first = i;
  }
}

double step_s(const Log& log, std::size_t i) {
  return 1e-6 * (log.samples[i].time_us - log.samples[i - 1].time_us);
}

/// Returns whether the land detector never sees a flight; estimators drift then.
bool stands_all_the_time(const Log& log) {
  double landed_s = 0;
  for (const LogEvent& event : log.events) landed_s += event.kind == "landed" ? event.duration_s : 0;
  return landed_s >= 0.99e-6 * (log.samples.back().time_us - log.samples.front().time_us) && landed_s > 0;
}

/// A vehicle flies above the ground, and the ground is near the origin.
void check_height(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kDeep_m = -0.5, kGround_m = 0.3;
  std::vector<double> heights;
  for (const Sample& sample : log.samples) heights.push_back(sample.position_m[2]);
  const double highest_m = *std::max_element(heights.begin(), heights.end());
  const double median_m = upper_median(std::move(heights));
  if (median_m > kDeep_m || highest_m > kGround_m) return;
  doubts.push_back(
      {"position", median_m,
       fmt::format("position: {:.2f} m high in the median and never above {:.2f} m; its z axis probably "
                   "points down; if so, invert it in a columns.toml: unit = \"-m\" for y and z",
                   median_m, highest_m),
       false});
}

/// The root mean squares of a change over stretches of `stretch_s`, as seen at their ends and as the sum of rates.
struct Changes {
  double seen = 0, summed = 0, count = 0;
  double ratio() const { return seen / std::max(summed, 1e-12); }
};
Changes changes(const Log& log, double stretch_s, Vector Sample::*rate,
                const std::function<double(const Sample&, const Sample&)>& seen) {
  Changes all;
  for_each_stretch(log, stretch_s, [&](std::size_t first, std::size_t last) {
    Vector sum{};
    for (std::size_t i = first + 1; i <= last; ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        sum[k] += 0.5 * step_s(log, i) * ((log.samples[i].*rate)[k] + (log.samples[i - 1].*rate)[k]);
    }
    const double change = seen(log.samples[first], log.samples[last]);
    if (std::isinf(change)) return;
    all.seen += change * change;
    all.summed += dot(sum, sum);
    all.count += 1;
  });
  all.seen = std::sqrt(all.seen / all.count);
  all.summed = std::sqrt(all.summed / all.count);
  return all;
}

/// Compares how far a vehicle moves according to its positions and according to its velocities.
void check_velocity(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kStretch_s = 0.2, kLeastMove_m = 0.01, kDoubt = 2, kRefusal = 30;
  const Changes moved = changes(log, kStretch_s, &Sample::velocity_m_s, [](const Sample& a, const Sample& b) {
    return norm(difference(b.position_m, a.position_m));
  });
  if (moved.count < 5 || std::max(moved.seen, moved.summed) < kLeastMove_m) return;
  const double ratio = moved.ratio();
  if (ratio < kDoubt && ratio > 1 / kDoubt) return;
  const char* const guess =
      is_near(ratio, 1000)    ? "positions in mm declared as m, or velocities declared as mm/s"
      : is_near(ratio, 0.001) ? "positions declared as mm, or velocities in mm/s declared as m/s"
                              : "units or frames of position, velocity or time differ";
  doubts.push_back(
      {"position", ratio,
       fmt::format("position: moves {:.3g} times as far as the velocities imply; probably {}", ratio, guess),
       ratio > kRefusal || ratio < 1 / kRefusal});
}

/// Compares how far a vehicle turns according to its rates and according to its attitudes.
void check_rates(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kStretch_s = 0.05, kLeastTurn_rad = 0.01, kLargestTurn_rad = 1, kDoubt = 10;
  const Changes turned = changes(log, kStretch_s, &Sample::rates_rad_s, [](const Sample& s, const Sample& t) {
    const Attitude &a = s.attitude, &b = t.attitude;
    const double angle_rad =
        2 * std::acos(std::min(std::abs(a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w), 1.0));
    return angle_rad > kLargestTurn_rad ? INFINITY : angle_rad;  // a tumble: the sum of rates is no angle
  });
  if (turned.count < 5 || turned.seen < kLeastTurn_rad) return;
  const double ratio = turned.summed / turned.seen;
  if (!(ratio > kDoubt) && !(ratio < 1 / kDoubt)) return;
  doubts.push_back({"rate", ratio,
                    fmt::format("rate: turns {:.3g} times as far as the attitudes imply; {}", ratio,
                                is_near(ratio, 57.3)     ? "probably deg/s declared as rad/s"
                                : is_near(ratio, 0.0175) ? "probably rad/s declared as deg/s"
                                                         : "the unit or the sensor is wrong"),
                    false});
}

/// Finds jumps of the specific force that rotors cannot produce: collisions, touch-down, wrapped integers.
void check_leaps(const Log& log, std::vector<Doubt>& doubts) {
  constexpr double kLargest_m_s2 = 2.5 * kGravity_m_s2, kLeap_m_s2 = 1 * kGravity_m_s2;
  std::size_t count = 0;
  double worst_m_s2 = 0, worst_s = 0;
  for (std::size_t i = 1; i < log.samples.size(); ++i) {
    const Vector &now = log.samples[i].specific_force_m_s2, &before = log.samples[i - 1].specific_force_m_s2;
    if (log.samples[i].restarts || norm(now) <= kLargest_m_s2 || norm(difference(now, before)) <= kLeap_m_s2)
      continue;
    ++count;
    if (norm(now) <= worst_m_s2) continue;
    worst_m_s2 = norm(now);
    worst_s = 1e-6 * log.samples[i].time_us;
  }
  if (count == 0) return;
  doubts.push_back({"specific_force", worst_m_s2,
                    fmt::format("specific_force: {} records jump beyond 2.5 g, the worst to {:.1f} m/s^2 at "
                                "{:.2f} s; an impact, or an integer that wrapped",
                                count, worst_m_s2, worst_s),
                    false});
}

}  // namespace

std::vector<Doubt> doubts_of(const Log& log) {
  std::vector<Doubt> doubts;
  check_time(log, doubts);
  if (log.samples.empty()) return doubts;
  const bool has_time = doubts.empty();
  if (log.signals.position && !stands_all_the_time(log)) {
    check_height(log, doubts);
    if (has_time) check_velocity(log, doubts);
  }
  if (log.signals.force) {
    check_specific_force(log, doubts);
    if (log.signals.thrust == ThrustSource::kDuty) {
      check_duty(log, doubts);
      check_battery(log, doubts);
    }
    if (has_time && log.signals.rates && log.signals.attitude) check_rates(log, doubts);
    const bool has_force =
        std::none_of(doubts.begin(), doubts.end(), [](const Doubt& d) { return d.refuses_force; });
    if (has_force) check_leaps(log, doubts);
  }
  return doubts;
}

}  // namespace swarmcert::logs

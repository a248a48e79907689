#include "analysis/logs/flight_story.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/logs/dictionary.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

constexpr double kIdleShare = 0.3;      // of the typical thrust of a log
constexpr double kLeastCommand = 0.02;  // of a motor that carries a vehicle
constexpr double kAboveStanding_m = 0.03;
constexpr double kShortestFlight_s = 0.5, kShortestPause_s = 0.3, kLongestTakeoff_s = 3;
constexpr double kNoThrustHeight_m = 0.15;

double seconds(const Log& log, std::size_t i) { return 1e-6 * log.samples[i].time_us; }

/// Returns the thrust in the log's own unit; empty if the log has none.
std::vector<double> thrust_of(const Log& log) {
  std::vector<double> thrust;
  if (log.signals.thrust == ThrustSource::kNone) return thrust;
  for (const Sample& s : log.samples)
    thrust.push_back(log.signals.thrust == ThrustSource::kDuty ? s.duty[0] + s.duty[1] + s.duty[2] + s.duty[3]
                                                               : s.given_thrust);
  return thrust;
}

/// Returns whether the commands of the motors, whose sum is typically `common`, are too small to carry any vehicle. If
/// it climbs nevertheless, their unit is another one.
bool are_motors_off(const Log& log, double common) {
  constexpr double kClimb_m = 0.2;
  const double command = log.signals.thrust == ThrustSource::kDuty ? common / 4 : log.hover_command;
  const auto [low, high] =
      std::minmax_element(log.samples.begin(), log.samples.end(),
                          [](const Sample& a, const Sample& b) { return a.position_m[2] < b.position_m[2]; });
  return command < kLeastCommand && !(high->position_m[2] - low->position_m[2] > kClimb_m);
}

/// Inverts runs of `value` that are shorter than `shortest_s`, except at the ends of the log.
void drop_short_runs(const Log& log, std::vector<char>& flags, char value, double shortest_s, bool at_ends) {
  std::size_t start = 0;
  for (std::size_t i = 1; i <= flags.size(); ++i) {
    if (i < flags.size() && flags[i] == flags[start]) continue;
    const bool inside = start > 0 && i < flags.size();
    if (flags[start] == value && (inside || at_ends) &&
        seconds(log, i - 1) - seconds(log, start) < shortest_s)
      std::fill(flags.begin() + static_cast<std::ptrdiff_t>(start),
                flags.begin() + static_cast<std::ptrdiff_t>(i), static_cast<char>(1 - value));
    start = i;
  }
}

/// Splits an airborne stretch into takeoff, flight and landing.
void add_flight(const Log& log, std::size_t first, std::size_t end, std::vector<Phase>& phases) {
  const double t0 = seconds(log, first), t1 = seconds(log, end - 1);
  double start = t0, stop = t1;
  std::vector<double> heights;
  for (std::size_t i = first; i < end; ++i) heights.push_back(log.samples[i].position_m[2]);
  const double middle = median(heights);
  const auto reached = [&](std::size_t i, double ground) {
    return std::abs(log.samples[i].position_m[2] - ground) > 0.8 * std::abs(middle - ground);
  };
  if (first > 0) {
    std::size_t i = first;
    while (i + 1 < end && !reached(i, heights.front()) && seconds(log, i) - t0 < kLongestTakeoff_s) ++i;
    start = seconds(log, i);
    phases.push_back({"takeoff", t0, start});
  }
  if (end < log.samples.size()) {
    std::size_t i = end - 1;
    while (i > first && !reached(i, heights.back()) && t1 - seconds(log, i) < kLongestTakeoff_s) --i;
    stop = std::max(start, seconds(log, i));
  }
  phases.push_back({"flight", start, stop});
  if (end < log.samples.size()) phases.push_back({"landing", stop, t1});
}

void add_phases(const Log& log, const std::vector<char>& air, FlightStory& story) {
  std::size_t start = 0;
  for (std::size_t i = 1; i <= air.size(); ++i) {
    if (i < air.size() && air[i] == air[start]) continue;
    if (air[start] != 0) {
      story.air_s += seconds(log, i - 1) - seconds(log, start);
      add_flight(log, start, i, story.phases);
    } else {
      story.phases.push_back({"ground", seconds(log, start), seconds(log, i - 1)});
    }
    start = i;
  }
}

/// Adds one event per run of records for which `holds` is true; runs less than 0.3 s apart are merged.
template <typename Holds>
void add_runs(const Log& log, const std::string& kind, double shortest_s, const std::string& what,
              const Holds& holds, std::vector<LogEvent>& events) {
  constexpr double kApart_s = 0.3;
  double start = 0, last = 0;
  bool open = false;
  const auto close = [&] {
    if (open && last - start >= shortest_s) events.push_back({kind, start, last - start, what});
    open = false;
  };
  for (std::size_t i = 0; i < log.samples.size(); ++i) {
    if (!holds(log.samples[i])) continue;
    const double now = seconds(log, i);
    if (open && now - last > kApart_s) close();
    if (!open) start = now;
    open = true;
    last = now;
  }
  close();
}

void add_events(const Log& log, const std::vector<char>& air, FlightStory& story) {
  constexpr double kImpact_m_s2 = 3 * kGravity_m_s2;
  story.events = log.events;
  for (std::size_t i = 1; i < log.samples.size(); ++i) {
    if (!log.samples[i].restarts) continue;
    const double pause_s = seconds(log, i) - seconds(log, i - 1);
    story.events.push_back({"dropout", seconds(log, i - 1), pause_s, "no record"});
  }
  const auto is_hit = [](const Sample& s) { return norm(s.specific_force_m_s2) > kImpact_m_s2; };
  const auto is_tilted = [](const Sample& s) { return s.attitude.rotation()[2][2] < 0.5; };
  const auto is_full = [](const Sample& s) {
    return *std::max_element(s.duty.begin(), s.duty.end()) > 0.998;
  };
  const char* const tilted = "thrust axis more than 60 degrees from the vertical";
  if (log.signals.force) add_runs(log, "impact", 0, "more than 3 g", is_hit, story.events);
  if (log.signals.attitude) add_runs(log, "impact", 0, tilted, is_tilted, story.events);
  if (log.signals.thrust == ThrustSource::kDuty)
    add_runs(log, "saturation", 0.05, "a motor at full duty", is_full, story.events);
  for (LogEvent& cycle : limit_cycles(log, air)) story.events.push_back(std::move(cycle));
  std::stable_sort(story.events.begin(), story.events.end(),
                   [](const LogEvent& a, const LogEvent& b) { return a.time_s < b.time_s; });
}

/// Returns the configuration lines that log a signal, in the syntax of the firmware that wrote the log.
std::string lines_for(const Log& log, const std::string& signal) {
  const bool is_crazyflie = log.format.rfind("usd", 0) == 0;
  return line_that_logs(is_crazyflie ? "crazyflie" : log.format == "ulog" ? "px4" : "stated", signal);
}

void add_missing(const Log& log, FlightStory& story) {
  const Signals& s = log.signals;
  const auto add = [&](const std::string& signal, const std::string& needed_for) {
    story.missing.push_back({signal, needed_for, lines_for(log, signal)});
  };
  if (s.thrust == ThrustSource::kNone) {
    add("duty", "any force");
    add("battery", "thrust from the duties");
  }
  if (s.thrust == ThrustSource::kForce) {
    add("duty", "thrust independent of the controller's own scale; mean torques");
    add("battery", "thrust from the duties; the effect of the battery");
  }
  const bool has_battery = std::any_of(log.sources.begin(), log.sources.end(), [](const SignalInfo& info) {
    return info.name == "battery" && info.source != SignalInfo::Source::kMissing;
  });
  if (s.thrust == ThrustSource::kHoverMultiple && s.motor_commands == 0 && !has_battery)
    add("battery", "a thrust in newton instead of multiples of the hover thrust");
  if (!s.attitude) add("attitude", "lateral forces");
  if (!s.position) add("position", "effects of height and of neighbours");
  if (s.specific_force == ForceSource::kNone) add("velocity", "any force, if there is no accelerometer");
  if (s.specific_force == ForceSource::kPosition)
    add("velocity", "forces within 100 ms and at a quarter of the noise");
  if (s.specific_force != ForceSource::kAccelerometer)
    add("specific_force", "forces faster than the window of the derivative");
  if (s.torque != TorqueUse::kDynamic) add("rates", "torques beyond their mean in slow flight");
  if (!s.targets) add("target", "comparison of the closed loop with the flight");
}

}  // namespace

std::vector<double> standing_heights_m(const std::vector<double>& time_s, const std::vector<double>& height_m,
                                       const std::vector<double>& speed_m_s, const std::vector<char>& idle) {
  constexpr double kStill_m_s = 0.1;
  const std::size_t n = idle.size();
  std::vector<double> heights(n, std::nan("")), away_s(n, INFINITY);
  const auto stands = [&](std::size_t i) { return idle[i] != 0 && speed_m_s[i] < kStill_m_s; };
  std::size_t last = n;
  for (std::size_t i = 0; i < n; ++i) {
    if (stands(i)) last = i;
    if (last == n) continue;
    heights[i] = height_m[last];
    away_s[i] = time_s[i] - time_s[last];
  }
  last = n;
  for (std::size_t i = n; i-- > 0;) {
    if (stands(i)) last = i;
    if (last < n && time_s[last] - time_s[i] < away_s[i]) heights[i] = height_m[last];
  }
  return heights;
}

std::vector<char> airborne(const Log& log) {
  const std::size_t n = log.samples.size();
  std::vector<char> air(n, 1), idle(n, 0);
  const std::vector<double> thrust = thrust_of(log);
  const double common = thrust.empty() ? 0 : quantile_of(thrust, 0.75);
  for (std::size_t i = 0; i < n && !thrust.empty(); ++i) idle[i] = !(thrust[i] > kIdleShare * common) ? 1 : 0;
  const bool is_off = n > 0 && are_motors_off(log, common);
  if (is_off || (!thrust.empty() && !(common > 0))) idle.assign(n, 1);
  if (!is_off && thrust.empty() && log.signals.position && n > 0) {
    // Without thrust, the vehicle is considered airborne while it is clearly above the lowest heights of the log.
    std::vector<double> heights;
    for (const Sample& s : log.samples) heights.push_back(s.position_m[2]);
    const double low = quantile_of(heights, 0.02);
    for (std::size_t i = 0; i < n; ++i) idle[i] = heights[i] < low + kNoThrustHeight_m ? 1 : 0;
    if (quantile_of(heights, 0.98) < low + kNoThrustHeight_m && std::abs(low) > 0.3) idle.assign(n, 0);
  }
  std::vector<double> time_s, height_m, speed_m_s;
  for (std::size_t i = 0; i < n; ++i) {
    time_s.push_back(seconds(log, i));
    height_m.push_back(log.samples[i].position_m[2]);
    speed_m_s.push_back(norm(log.samples[i].velocity_m_s));
  }
  const std::vector<double> standing = standing_heights_m(time_s, height_m, speed_m_s, idle);
  for (std::size_t i = 0; i < n; ++i) {
    const bool low = log.signals.position && log.samples[i].position_m[2] < standing[i] + kAboveStanding_m;
    air[i] = idle[i] == 0 && !low ? 1 : 0;
  }
  for (const LogEvent& event : log.events) {
    if (event.kind != "landed") continue;
    for (std::size_t i = 0; i < n; ++i) {
      if (time_s[i] >= event.time_s && time_s[i] <= event.time_s + event.duration_s) air[i] = 0;
    }
  }
  drop_short_runs(log, air, 0, kShortestPause_s, false);
  drop_short_runs(log, air, 1, kShortestFlight_s, true);
  return air;
}

FlightStory tell(const Log& log) {
  FlightStory story;
  const std::vector<char> air = airborne(log);
  if (!log.samples.empty()) add_phases(log, air, story);
  add_events(log, air, story);
  add_missing(log, story);
  bool any_battery = false;
  for (std::size_t i = 0; i < air.size(); ++i) {
    const double volt = log.samples[i].battery_V;
    if (air[i] == 0 || !(volt > 0)) continue;
    if (!any_battery) story.battery_first_V = story.battery_least_V = volt;
    any_battery = true;
    story.battery_least_V = std::min(story.battery_least_V, volt);
    story.battery_last_V = volt;
  }
  if (log.armed == Armed::kNever)
    story.no_flight = "never armed";
  else if (!log.signals.not_multirotor.empty())
    story.no_flight = "the vehicle is a " + log.signals.not_multirotor;
  else if (log.samples.empty())
    story.no_flight = "no record";
  else if (story.air_s == 0)
    story.no_flight = "stands on the ground";
  return story;
}

}  // namespace swarmcert::logs

/// Events in flights, and clocks shared by several vehicles.
#include "analysis/logs/flight_story.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>
#include <sstream>

#include "analysis/logs/clock.h"
#include "analysis/logs/read_log.h"
#include "data.h"

namespace swarmcert::tests {
namespace {

/// Returns a log of 12 s in flight at 250 Hz with the roll angle `roll(t)`.
logs::Log rolling(const std::function<double(double)>& roll_rad) {
  logs::Log log;
  log.signals.rates = true;
  constexpr double kStep_s = 0.004;
  for (int k = 0; k < 3000; ++k) {
    logs::Sample s;
    s.time_us = 1e6 * kStep_s * k;
    s.restarts = k == 0;
    const double t = kStep_s * k;
    s.rates_rad_s = {(roll_rad(t + kStep_s) - roll_rad(t)) / kStep_s, 0, 0};
    log.samples.push_back(s);
  }
  return log;
}

std::vector<logs::LogEvent> cycles_of(const std::function<double(double)>& roll_rad) {
  const logs::Log log = rolling(roll_rad);
  return logs::limit_cycles(log, std::vector<char>(log.samples.size(), 1));
}

constexpr double kTwoPi = 6.283185307179586;

TEST(LimitCycles, ASustainedOscillationIsNamedWithItsFrequencyAndAmplitude) {
  for (const double hz : {1.3, 2.8, 6.0}) {
    const auto events =
        cycles_of([hz](double t) { return t < 3 || t > 9 ? 0 : 0.15 * std::sin(kTwoPi * hz * t); });
    ASSERT_EQ(events.size(), 1u) << hz;
    EXPECT_NEAR(events[0].time_s, 3, 1.2 / hz);
    EXPECT_NEAR(events[0].duration_s, 6, 2.5 / hz);
    EXPECT_NE(events[0].what.find(fmt::format("{:.2g} Hz", hz)), std::string::npos) << events[0].what;
    EXPECT_NE(events[0].what.find("roll"), std::string::npos) << events[0].what;
  }
}

TEST(LimitCycles, DampedOscillationsManoeuvresAndVibrationAreNone) {
  // Damping ratio 0.1 after a push of 0.3 rad.
  EXPECT_TRUE(cycles_of([](double t) {
                return t < 2 ? 0
                             : 0.3 * std::exp(-0.1 * kTwoPi * 2 * (t - 2)) * std::sin(kTwoPi * 2 * (t - 2));
              }).empty());
  // A slalom of 0.4 rad at 0.4 Hz, as a trajectory may command.
  EXPECT_TRUE(cycles_of([](double t) { return 0.4 * std::sin(kTwoPi * 0.4 * t); }).empty());
  // 0.02 rad at 20 Hz, whose rate is 2.5 rad/s.
  EXPECT_TRUE(cycles_of([](double t) { return 0.02 * std::sin(kTwoPi * 20 * t); }).empty());
  // One period in four has a different length.
  EXPECT_TRUE(cycles_of([](double t) {
                return 0.15 * std::sin(kTwoPi * 2 * t + 2.5 * std::sin(kTwoPi * 0.5 * t));
              }).empty());
}

/// The events of a vehicle that rolls 0.15 rad at 2 Hz while its set point moves along y.
std::vector<logs::LogEvent> cycles_with_set_point(const std::function<double(double)>& velocity_m_s) {
  logs::Log log = rolling([](double t) { return t < 3 || t > 9 ? 0 : 0.15 * std::sin(kTwoPi * 2 * t); });
  log.signals.targets = true;
  for (logs::Sample& s : log.samples) s.target_velocity_m_s = {0, velocity_m_s(1e-6 * s.time_us), 0};
  return logs::limit_cycles(log, std::vector<char>(log.samples.size(), 1));
}

TEST(LimitCycles, AnOscillationThatTheSetPointAsksForIsAnExcitation) {
  const double most_m_s = 0.15 * 9.81 / (kTwoPi * 2);
  const auto asked = [most_m_s](double share, double hz) {
    return [=](double t) { return share * most_m_s * std::cos(kTwoPi * hz * t); };
  };
  EXPECT_TRUE(cycles_with_set_point(asked(1, 2)).empty());
  EXPECT_TRUE(cycles_with_set_point(asked(0.7, 2)).empty()) << "the loop amplifies it";
  EXPECT_EQ(cycles_with_set_point(asked(0.2, 2)).size(), 1u) << "too little to be its cause";
  EXPECT_EQ(cycles_with_set_point(asked(8, 0.4)).size(), 1u) << "a slalom beside a limit cycle";
  EXPECT_EQ(cycles_with_set_point([](double) { return 0.0; }).size(), 1u);
}

TEST(LimitCycles, OfTheFlightsThatOscillateAreFoundAndOfTheirRepetitionNot) {
  SWARMCERT_NEEDS_DATA();
  // According to independent scripts, 29, 76, 113, 119 and 146 oscillate, and 113_2 with the same gains does not. So do
  // 26, 78 and 129, with four or more equal periods of at least 6 degrees, in hover and at the end of the trajectory.
  std::set<std::string> cycling;
  std::size_t flights = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(data_path("collections/crazyswarm2-tools/logs"))) {
    ++flights;
    const logs::FlightStory story = logs::tell(logs::read_log(entry.path().string()));
    if (std::any_of(story.events.begin(), story.events.end(),
                    [](const logs::LogEvent& event) { return event.kind == "limit cycle"; }))
      cycling.insert(entry.path().filename().string());
  }
  EXPECT_GE(flights, 100u);
  EXPECT_EQ(cycling, (std::set<std::string>{"log113", "log119", "log129", "log146", "log26", "log29", "log76",
                                            "log78"}));
}

/// Returns a log of 10 s in which the motors have `duty` and the vehicle climbs by `climb_m`.
logs::Log driven(double duty, double climb_m) {
  logs::Log log;
  log.signals.thrust = logs::ThrustSource::kDuty;
  log.signals.position = true;
  for (int k = 0; k < 1000; ++k) {
    logs::Sample s;
    s.time_us = 1e4 * k;
    s.duty.fill(duty);
    s.position_m[2] = 0.3 + climb_m * k / 1000;
    log.samples.push_back(s);
  }
  return log;
}

TEST(FlightStory, MotorsThatBarelyTurnCarryNoVehicle) {
  for (const double duty : {0.0, 0.001, 0.01}) {
    EXPECT_EQ(logs::tell(driven(duty, 0)).air_s, 0) << duty;
    EXPECT_FALSE(logs::tell(driven(duty, 0)).no_flight.empty()) << duty;
  }
  EXPECT_GT(logs::tell(driven(0.4, 0)).air_s, 9) << "a hover throughout";
  EXPECT_GT(logs::tell(driven(0.004, 1)).air_s, 9) << "a flight whose duty has another unit";
}

logs::RawLog with_receiver(const std::string& topic, const std::vector<std::string>& names,
                           const std::vector<std::vector<double>>& rows) {
  logs::RawLog raw;
  raw.topics.emplace_back();
  raw.topics[0].name = topic;
  for (const std::string& name : names) raw.topics[0].columns.push_back({name, {}});
  for (const std::vector<double>& row : rows) {
    raw.topics[0].time_s.push_back(row[0]);
    for (std::size_t k = 0; k < names.size(); ++k) raw.topics[0].columns[k].values.push_back(row[k + 1]);
  }
  return raw;
}

TEST(AbsoluteTime, ComesFromTheReceiversOfPx4AndArduPilot) {
  // 0 while the receiver has no time yet; the vehicle's clock started 1772419700 s after 1970.
  const logs::RawLog px4 = with_receiver("vehicle_gps_position", {"time_utc_usec"},
                                         {{10, 0}, {20, 1772419720e6}, {30, 1772419730e6}});
  EXPECT_NEAR(logs::receiver_offset_s(px4), 1772419700, 1e-3);
  EXPECT_NEAR(logs::absolute_span_s(px4).lower, 1772419710, 1e-3);
  EXPECT_NEAR(logs::absolute_span_s(px4).upper, 1772419730, 1e-3);
  // 2026-03-02 02:48:40 UTC is 96538 s into GPS week 2408; GPS time is 18 s ahead.
  const logs::RawLog ardupilot =
      with_receiver("GPS", {"GWk", "GMS"}, {{20, 2408, 96538e3}, {21, 2408, 96539e3}});
  EXPECT_NEAR(logs::receiver_offset_s(ardupilot), 1772419720 - 20, 1e-3);
  EXPECT_EQ(logs::absolute_span_s(with_receiver("count", {"number"}, {{1, 2}, {2, 3}})), Interval());
}

TEST(Collections, DerivedAccelerationReachesTheNoiseFloorsOfCalmFlight) {
  SWARMCERT_NEEDS_DATA();
  // Noise floors of a velocity over 100 ms according to independent scripts, m/s^2: calm flight with motion capture
  // 0.02, others as flown.
  const std::pair<const char*, double> floors_m_s2[] = {
      {"crazyswarm2-tools/logs", 0.02}, {"crazypad", 0.13}, {"nanobench", 0.09}};
  for (const auto& [folder, floor_m_s2] : floors_m_s2) {
    std::vector<double> noise;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(data_path(std::string("collections/") + folder))) {
      if (!entry.is_regular_file() || entry.path().extension() == ".md" ||
          !logs::looks_like_log(entry.path().string()))
        continue;
      if (noise.size() == 40) break;
      for (const logs::SignalInfo& signal : logs::read_log(entry.path().string()).sources) {
        if (signal.name == "acceleration") noise.push_back(signal.noise);
      }
    }
    ASSERT_GE(noise.size(), 4u) << folder;
    std::sort(noise.begin(), noise.end());
    EXPECT_LE(noise[noise.size() / 2], 1.3 * floor_m_s2) << folder;
  }
}

}  // namespace
}  // namespace swarmcert::tests

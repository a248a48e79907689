/// Pitfalls of real logs, each in its own flight: saturated integers, wrapping angles and counters, groups at different
/// rates, headers before a gap, several hops, delays, rotor speeds, commanded forces.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "analysis/logs/flight_story.h"
#include "analysis/logs/interpretation.h"
#include "analysis/logs/read_log.h"
#include "nn/base/rotor_speed.h"

namespace swarmcert::tests {
namespace {

constexpr double kTurn_rad = 6.28318530717958647692;

logs::Log parse_text(const std::string& text) {
  std::istringstream in(text);
  return logs::parse_log(in, "trap.csv");
}

std::size_t count_events(const logs::Log& log, const std::string& kind) {
  return static_cast<std::size_t>(std::count_if(
      log.events.begin(), log.events.end(), [&](const logs::LogEvent& event) { return event.kind == kind; }));
}

bool says(const logs::Log& log, const std::string& words) {
  return std::any_of(log.interpretation.begin(), log.interpretation.end(),
                     [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

/// Vertical oscillation of 0.1 m about a height of 1 m, with the required thrust in units of the weight.
struct Bob {
  double z, vz, load;
  explicit Bob(double t)
      : z(1 + 0.1 * std::sin(5 * t)),
        vz(0.5 * std::cos(5 * t)),
        load(1 - 2.5 * std::sin(5 * t) / logs::kGravity_m_s2) {}
};

TEST(LogTraps, AnIntegerThatStaysAtItsEndIsSaturated) {
  std::string text =
      "time_us,stateEstimateZ.x,stateEstimateZ.y,stateEstimateZ.z,stateEstimateZ.vx,stateEstimateZ.vy,"
      "stateEstimateZ.vz\n";
  for (int k = 0; k < 100; ++k)
    text += fmt::format("{},{},0,1000,500,0,0\n", 10000 * k, std::min(32767, 32600 + 5 * k));
  const logs::Log log = parse_text(text);
  EXPECT_GT(count_events(log, "saturation"), 0u);
  EXPECT_EQ(count_events(log, "wrap"), 0u);
}

TEST(LogTraps, AYawThatWrapsTurnsOn) {
  std::string text = "time,x,y,z,vx,vy,vz,roll,pitch,yaw\n";
  for (int k = 0; k < 800; ++k) {
    const double t = 0.01 * k, yaw = std::remainder(0.8 * t + 2, kTurn_rad);
    text += fmt::format("{:.2f},{:.4f},0,1,{:.4f},0,0,0,0,{:.5f}\n", t, 0.1 * std::sin(t), 0.1 * std::cos(t),
                        yaw * 360 / kTurn_rad);
  }
  const logs::Log log = parse_text(text);
  ASSERT_GT(log.samples.size(), 700u);
  std::size_t half_turns = 0;
  for (const logs::Sample& sample : log.samples) {
    const double t = 1e-6 * sample.time_us;
    const auto R = sample.attitude.rotation();
    EXPECT_NEAR(std::remainder(std::atan2(R[1][0], R[0][0]) - (0.8 * t + 2), kTurn_rad), 0, 1e-3) << t;
    half_turns += std::abs(std::remainder(0.8 * t + 2, kTurn_rad)) > 3.1 ? 1 : 0;
  }
  EXPECT_GT(half_turns, 3u) << "the yaw wraps within the flight";
}

TEST(LogTraps, GroupsAtDifferentRatesShareOneClock) {
  logs::RawLog raw;
  raw.path = "groups";
  raw.format = "usd version 2";
  logs::RawTopic motion, battery;
  motion.name = "fast";
  for (const char* const name :
       {"stateEstimate.x", "stateEstimate.y", "stateEstimate.z", "stateEstimate.vx", "stateEstimate.vy",
        "stateEstimate.vz", "pwm.m1_pwm", "pwm.m2_pwm", "pwm.m3_pwm", "pwm.m4_pwm"})
    motion.columns.push_back({name, {}});
  battery.name = "slow";
  battery.columns.push_back({"pm.vbat", {}});
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.002 * k;
    const Bob bob(t);
    motion.time_s.push_back(t);
    const double values[] = {0, 0, bob.z, 0, 0, bob.vz};
    for (std::size_t c = 0; c < 10; ++c)
      motion.columns[c].values.push_back(c < 6 ? values[c] : 40000 * std::sqrt(bob.load));
    if (k % 50 != 0) continue;
    battery.time_s.push_back(t);
    battery.columns[0].values.push_back(4.0 - 0.01 * t);
  }
  raw.topics = {battery, motion};
  const logs::Log log = logs::interpret(raw, {});
  ASSERT_GT(log.samples.size(), 1900u) << "the motion's records become samples";
  const logs::Sample& sample = log.samples[1000];
  EXPECT_NEAR(sample.battery_V, 4.0 - 0.01 * 1e-6 * sample.time_us, 2e-3);
  EXPECT_NEAR(sample.position_m[2], Bob(1e-6 * sample.time_us).z, 1e-3);
}

TEST(LogTraps, AHeadBeforeAGapDoesNotBendTheFirstAcceleration) {
  std::string text = "time,x,y,z,vx,vy,vz,m1,m2,m3,m4,vbat\n";
  const auto line = [](double t, double z) {
    const Bob bob(t);
    return fmt::format("{0:.3f},0,0,{1:.5f},0,0,{2:.5f},{3:.5f},{3:.5f},{3:.5f},{3:.5f},3.9\n", t, z, bob.vz,
                       0.6 * std::sqrt(bob.load));
  };
  for (int k = 0; k < 4; ++k) text += line(0.01 * k, 0);  // before the pause the vehicle was elsewhere
  for (int k = 0; k < 800; ++k) text += line(1.2 + 0.01 * k, Bob(1.2 + 0.01 * k).z);
  const logs::Log log = parse_text(text);
  EXPECT_EQ(log.health.gaps, 1u);
  double largest = 0;
  for (const logs::Sample& sample : log.samples) {
    const double t = 1e-6 * sample.time_us;
    if (t < 1.3 || t > 9) continue;
    largest = std::max(largest, std::abs(sample.specific_force_m_s2[2] - logs::kGravity_m_s2 * Bob(t).load));
  }
  EXPECT_LT(largest, 0.1) << "m/s^2; across the gap the velocity would jump";
}

TEST(LogTraps, BetweenTwoHopsTheVehicleStandsOnTheGround) {
  std::string text = "time,x,y,z,vx,vy,vz,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 2600; ++k) {
    const double t = 0.01 * k;
    double z = -0.2, vz = 0;  // an estimator that starts below the floor
    bool flies = false;
    for (const double start : {3.0, 15.0}) {
      z += std::clamp(t - start, 0.0, 1.0) - std::clamp(t - start - 6, 0.0, 1.0);
      vz += t > start && t < start + 1 ? 1 : t > start + 6 && t < start + 7 ? -1 : 0;
      flies = flies || (t > start && t < start + 7);
    }
    text += fmt::format("{0:.3f},0,0,{1:.4f},0,0,{2},{3},{3},{3},{3},3.8\n", t, z, vz, flies ? 0.5 : 0.02);
  }
  const logs::FlightStory story = logs::tell(parse_text(text));
  std::string phases;
  for (const logs::Phase& phase : story.phases) phases += phase.name + " ";
  EXPECT_EQ(phases, "ground takeoff flight landing ground takeoff flight landing ground ");
  EXPECT_NEAR(story.air_s, 14, 0.5);
}

TEST(LogTraps, AThrustThatActsLateIsReportedWithItsDelay) {
  constexpr double kDelay_s = 0.04;
  std::string text = "time,x,y,z,vx,vy,vz,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    text += fmt::format("{0:.3f},0,0,{1:.5f},0,0,{2:.5f},{3:.5f},{3:.5f},{3:.5f},{3:.5f},3.9\n", t, Bob(t).z,
                        Bob(t).vz, 0.6 * std::sqrt(Bob(t + kDelay_s).load));
  }
  const logs::Log log = parse_text(text);
  ASSERT_FALSE(log.delays.empty());
  EXPECT_EQ(log.delays[0].signal, "specific_force");
  EXPECT_EQ(log.delays[0].against, "thrust");
  EXPECT_NEAR(log.delays[0].delay_s, kDelay_s, 0.01);
}

TEST(LogTraps, ThrustFollowsTheSquareOfRotorSpeedsOfWhichOneIsHalved) {
  std::string text = "time,x,y,z,vx,vy,vz,rpm.m1,rpm.m2,rpm.m3,rpm.m4,pm.vbat\n";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k, rpm = 18000 * std::sqrt(Bob(t).load);
    text += fmt::format("{0:.3f},0,0,{1:.5f},0,0,{2:.5f},{3:.1f},{3:.1f},{4:.1f},{3:.1f},3.9\n", t, Bob(t).z,
                        Bob(t).vz, rpm, rpm / 2);
  }
  const logs::Log log = parse_text(text);
  EXPECT_TRUE(says(log, "rotor 3: its speed is 0.50 of the others': doubled"));
  ASSERT_NE(log.signals.thrust, logs::ThrustSource::kNone);
  std::size_t compared = 0;
  for (const logs::Sample& sample : log.samples) {
    const double t = 1e-6 * sample.time_us;
    if (t < 1 || t > 9) continue;
    EXPECT_NEAR(sample.given_thrust, Bob(t).load, 0.02) << "in multiples of the hover thrust";
    ++compared;
  }
  EXPECT_GT(compared, 700u);
}

TEST(LogTraps, ElectricalRotorSpeedsGiveCommandsAndImpossibleOnesAreReplaced) {
  constexpr double kPolePairs = 6, kPi_rad = 3.14159265358979323846;
  std::string text = "time,x,y,z,vx,vy,vz,m1_erpm,m2_erpm,m3_erpm,m4_erpm\n";
  constexpr int kSpike = 500;
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k, erpm = kPolePairs * 18000 * std::sqrt(Bob(t).load);
    text += fmt::format("{0:.3f},0,0,{1:.5f},0,0,{2:.5f},{3:.1f},{3:.1f},{4:.1f},{3:.1f}\n", t, Bob(t).z,
                        Bob(t).vz, erpm, k == kSpike ? 1e7 : erpm);
  }
  const logs::Log log = parse_text(text);
  EXPECT_TRUE(says(log, "rotor 3: 1 records without a possible speed, taken from the others"));
  EXPECT_EQ(log.signals.motor_commands, 4);
  EXPECT_EQ(log.motor_power, 2);
  ASSERT_EQ(log.samples.size(), 1000u);
  for (const int k : {100, kSpike, 900}) {
    const double speed_rad_s = 18000 * std::sqrt(Bob(0.01 * k).load) * 2 * kPi_rad / 60;
    EXPECT_NEAR(log.samples[static_cast<std::size_t>(k)].motor_command[2],
                speed_rad_s / kFullRotorSpeed_rad_s, 1e-5);
  }
}

TEST(LogTraps, TheControllersCommandedForceIsAThrust) {
  std::string text = "time,x,y,z,vx,vy,vz,ctrlLee.thrustSI\n";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    text += fmt::format("{:.3f},0,0,{:.5f},0,0,{:.5f},{:.6f}\n", t, Bob(t).z, Bob(t).vz,
                        0.037 * logs::kGravity_m_s2 * Bob(t).load);
  }
  const logs::Log log = parse_text(text);
  EXPECT_EQ(log.signals.thrust, logs::ThrustSource::kForce);
  EXPECT_TRUE(log.signals.force_axes[2]);
}

TEST(LogTraps, TheCommandedForcesOfTheRotorsSumToAThrust) {
  std::string text = "time,x,y,z,vx,vy,vz,motor.f1,motor.f2,motor.f3,motor.f4\n";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k, force_N = 0.037 * logs::kGravity_m_s2 * Bob(t).load;
    text += fmt::format("{:.3f},0,0,{:.5f},0,0,{:.5f},{:.6f},{:.6f},{:.6f},{:.6f}\n", t, Bob(t).z, Bob(t).vz,
                        0.1 * force_N, 0.2 * force_N, 0.3 * force_N, 0.4 * force_N);
  }
  const logs::Log log = parse_text(text);
  EXPECT_EQ(log.signals.thrust, logs::ThrustSource::kForce);
  EXPECT_TRUE(log.signals.force_axes[2]);
  ASSERT_GT(log.samples.size(), 900u);
  for (const logs::Sample& sample : log.samples)
    EXPECT_NEAR(sample.given_thrust, 0.037 * logs::kGravity_m_s2 * Bob(1e-6 * sample.time_us).load, 5e-6);
}

}  // namespace
}  // namespace swarmcert::tests

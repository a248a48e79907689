/// From columns to signals: units, frames and signs decided from the data, derived signals, and the flights of several
/// collections.
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <tuple>

#include "analysis/logs/battery_compensation.h"
#include "analysis/logs/columns_draft.h"
#include "analysis/logs/flight_story.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/hover_scale.h"
#include "analysis/logs/read_log.h"
#include "data.h"

namespace swarmcert::tests {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// A vehicle that oscillates: x = 0.3 sin 3 t, y = 0.2 sin 2 t, z = 1, with its thrust axis along acceleration + g.
struct Swing {
  double t, x, y, vx, vy, ax, ay, roll, pitch;

  explicit Swing(double time_s) : t(time_s) {
    x = 0.3 * std::sin(3 * t);
    y = 0.2 * std::sin(2 * t);
    vx = 0.9 * std::cos(3 * t);
    vy = 0.4 * std::cos(2 * t);
    ax = -2.7 * std::sin(3 * t);
    ay = -0.8 * std::sin(2 * t);
    pitch = std::atan2(ax, logs::kGravity_m_s2);
    roll = std::atan2(-ay, std::hypot(ax, logs::kGravity_m_s2));
  }
  std::array<double, 4> quaternion() const {  // x, y, z, w
    const double cr = std::cos(roll / 2), sr = std::sin(roll / 2), cp = std::cos(pitch / 2),
                 sp = std::sin(pitch / 2);
    return {sr * cp, cr * sp, -sr * sp, cr * cp};
  }
  double load() const { return std::sqrt(ax * ax + ay * ay + logs::kGravity_m_s2 * logs::kGravity_m_s2); }
};

/// Returns a CSV of the oscillation at 100 Hz for 8 s; `cells` gives the columns after position and velocity.
logs::Log swing(
    const std::string& names, const std::function<std::string(const Swing&)>& cells,
    const std::function<std::string(double)>& clock = [](double t) { return fmt::format("{:.4f}", t); }) {
  std::string text = "t,px,py,pz,vx,vy,vz," + names + "\n";
  for (int k = 0; k < 800; ++k) {
    const Swing s(0.01 * k);
    text +=
        fmt::format("{},{:.6f},{:.6f},1,{:.6f},{:.6f},0,{}\n", clock(s.t), s.x, s.y, s.vx, s.vy, cells(s));
  }
  std::istringstream in(text);
  return logs::parse_log(in, "swing.csv");
}

const logs::SignalInfo& signal(const logs::Log& log, const std::string& name) {
  for (const logs::SignalInfo& info : log.sources) {
    if (info.name == name) return info;
  }
  static const logs::SignalInfo none;
  ADD_FAILURE() << log.path << " says nothing of " << name;
  return none;
}

/// Returns the largest error of the thrust axis over the middle of the log.
double axis_error(const logs::Log& log) {
  double largest = 0;
  for (std::size_t i = 50; i + 50 < log.samples.size(); ++i) {
    const Swing s(1e-6 * log.samples[i].time_us);
    const auto R = log.samples[i].attitude.rotation();
    largest = std::max({largest, std::abs(R[0][2] - s.ax / s.load()), std::abs(R[1][2] - s.ay / s.load())});
  }
  return largest;
}

double force_error_m_s2(const logs::Log& log) {
  double largest = 0;
  for (std::size_t i = 50; i + 50 < log.samples.size(); ++i) {
    const Swing s(1e-6 * log.samples[i].time_us);
    const logs::Vector& f = log.samples[i].specific_force_m_s2;
    largest = std::max(
        {largest, std::abs(f[0] - s.ax), std::abs(f[1] - s.ay), std::abs(f[2] - logs::kGravity_m_s2)});
  }
  return largest;
}

const char kMotors[] = ",m1,m2,m3,m4,vbat";
std::string motors(const Swing& s) {
  const double m = 0.5 * s.load() / logs::kGravity_m_s2;
  return fmt::format(",{0:.5f},{0:.5f},{0:.5f},{0:.5f},3.7", m);
}

TEST(Interpretation, DecidesUnitsAndSignsOfAnglesFromTheLateralAcceleration) {
  const double degree = 180 / kPi;
  for (const double unit : {1.0, degree}) {
    for (const double pitch_sign : {1.0, -1.0}) {
      const logs::Log log = swing(std::string("roll,pitch,yaw") + kMotors, [&](const Swing& s) {
        return fmt::format("{:.6f},{:.6f},0.0", unit * s.roll, unit * pitch_sign * s.pitch) + motors(s);
      });
      EXPECT_LT(axis_error(log), 0.01) << "unit " << unit << ", sign " << pitch_sign;
      EXPECT_TRUE(log.signals.attitude);
      EXPECT_FALSE(log.interpretation.empty());
    }
  }
}

/// The swing with every column in a different unit, stated in its name in the style of `names`.
logs::Log swing_in_units(const std::string& names, double length, double angle, double force) {
  std::string text = names + "\n";
  for (int k = 0; k < 800; ++k) {
    const Swing s(0.01 * k);
    text += fmt::format("{:.4f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},0,", s.t, length * s.x, length * s.y,
                        length, length * s.vx, length * s.vy);
    text += fmt::format("{:.6f},{:.6f},0,0,0,{:.6f}", angle * s.roll, angle * s.pitch, force * s.load());
    text += motors(s) + "\n";
  }
  std::istringstream in(text);
  return logs::parse_log(in, "swing.csv");
}

TEST(Interpretation, TakesUnitsThatNamesState) {
  const double degree = 180 / kPi;
  const std::string motors = ",m1,m2,m3,m4,vbat_V";
  const std::tuple<std::string, double, double, double> cases[] = {
      {"t_s,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,roll_rad,pitch_rad,yaw_rad,acc_x_mps2,acc_y_mps2,acc_z_mps2", 1,
       1, 1},
      {"Time (s),X (mm),Y (mm),Z (mm),VX (mm/s),VY (mm/s),VZ (mm/s),Roll (deg),Pitch (deg),Yaw (deg),"
       "acc_x (m/s^2),acc_y (m/s^2),acc_z (m/s^2)",
       1000, degree, 1},
      {"time_s,pos_x_cm,pos_y_cm,pos_z_cm,vel_x_cmps,vel_y_cmps,vel_z_cmps,roll_deg,pitch_deg,yaw_deg,"
       "accel_x_g,accel_y_g,accel_z_g",
       100, degree, 1 / logs::kGravity_m_s2}};
  for (const auto& [names, length, angle, force] : cases) {
    SCOPED_TRACE(names);
    const logs::Log log = swing_in_units(names + motors, length, angle, force);
    ASSERT_EQ(log.samples.size(), 800u);
    EXPECT_NEAR(log.samples[100].position_m[2], 1, 1e-6);
    EXPECT_NEAR(log.samples[100].velocity_m_s[0], Swing(1).vx, 1e-5);
    EXPECT_LT(axis_error(log), 1e-4);
    EXPECT_LT(force_error_m_s2(log), 0.01);
  }
}

TEST(Interpretation, AnAccelerometerThatIsCalledAsTheFirmwaresIsInTheUnitThatItShows) {
  const auto flown = [](double force) {
    return swing(std::string("roll,pitch,yaw,acc_x,acc_y,acc_z") + kMotors, [&](const Swing& s) {
      return fmt::format("{:.6f},{:.6f},0,0,0,{:.6f}", s.roll, s.pitch, force * s.load()) + motors(s);
    });
  };
  for (const double per_m_s2 : {1.0, 1 / logs::kGravity_m_s2, 1000.0, 1000 / logs::kGravity_m_s2})
    EXPECT_LT(force_error_m_s2(flown(per_m_s2)), 0.01) << per_m_s2;
  // A norm of 0.3 g fits no unit: it is not used, and that is said.
  const logs::Log faulty = flown(0.3 / logs::kGravity_m_s2);
  EXPECT_EQ(faulty.signals.specific_force, logs::ForceSource::kVelocity);
  EXPECT_NE(fmt::format("{}", fmt::join(faulty.interpretation, "\n")).find("not used: acc_x"),
            std::string::npos);
}

TEST(Interpretation, DecidesTheOrderOfAQuaternion) {
  const logs::Log log = swing(std::string("q0,q1,q2,q3") + kMotors, [&](const Swing& s) {
    const auto q = s.quaternion();
    return fmt::format("{:.6f},{:.6f},{:.6f},{:.6f}", q[3], q[0], q[1], q[2]) + motors(s);
  });
  EXPECT_LT(axis_error(log), 1e-3);
}

TEST(Interpretation, DecidesUnitFrameAndGravityOfAnAccelerometer) {
  const double g = logs::kGravity_m_s2;
  for (const double unit : {1.0, 1 / g, 1000 / g}) {  // m/s^2, g, mg
    const logs::Log body = swing(std::string("ax,ay,az,qx,qy,qz,qw") + kMotors, [&](const Swing& s) {
      const auto q = s.quaternion();
      return fmt::format("0.0001,0,{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}", unit * s.load(), q[0], q[1], q[2],
                         q[3]) +
             motors(s);
    });
    EXPECT_LT(force_error_m_s2(body), 0.05) << unit;
    EXPECT_EQ(body.signals.specific_force, logs::ForceSource::kAccelerometer);
  }
  const logs::Log world = swing(std::string("ax,ay,az,qx,qy,qz,qw") + kMotors, [&](const Swing& s) {
    const auto q = s.quaternion();
    return fmt::format("{:.6f},{:.6f},0.0,{:.6f},{:.6f},{:.6f},{:.6f}", s.ax, s.ay, q[0], q[1], q[2], q[3]) +
           motors(s);
  });
  EXPECT_LT(force_error_m_s2(world), 0.05) << "in the world, without gravity";
}

TEST(Interpretation, ReadsClocksInSecondsMillisecondsMicrosecondsAndFrom1970) {
  const auto cells = [](const Swing& s) { return "0" + motors(s); };
  for (const double unit : {1.0, 1e3, 1e6}) {
    const logs::Log log = swing(std::string("mode") + kMotors, cells,
                                [&](double t) { return fmt::format("{:.3f}", unit * (t + 1)); });
    EXPECT_NEAR(log.samples.back().time_us - log.samples.front().time_us, 7.99e6, 1) << unit;
  }
  const logs::Log log = swing(std::string("mode") + kMotors, cells,
                              [](double t) { return fmt::format("{:.6f}", 1772419726.25 + t); });
  EXPECT_EQ(log.epoch_s, 1772419726);
  EXPECT_NEAR(log.samples.back().time_us, 8.24e6, 1);
}

TEST(Interpretation, LengthsInMillimetresAreSeenInBracketsAndInTheVelocities) {
  for (const char* names : {"Position X (mm),Position Y (mm),Position Z (mm)", "PosX,PosY,PosZ"}) {
    std::string text = std::string("Time [s],") + names + ",VelX,VelY,VelZ,BatteryVoltage\n";
    for (int k = 0; k < 800; ++k) {
      const Swing s(0.01 * k);
      text += fmt::format("{:.4f},{:.4f},{:.4f},1000,{:.6f},{:.6f},0,3.8\n", s.t, 1000 * s.x, 1000 * s.y,
                          s.vx, s.vy);
    }
    std::istringstream in(text);
    const logs::Log log = logs::parse_log(in, "swing.csv");
    for (std::size_t i = 0; i < log.samples.size(); i += 50) {
      EXPECT_NEAR(log.samples[i].position_m[0], Swing(1e-6 * log.samples[i].time_us).x, 1e-3) << names;
      EXPECT_NEAR(log.samples[i].position_m[2], 1, 1e-9) << names;
    }
    EXPECT_EQ(log.samples[0].battery_V, 3.8);
  }
}

TEST(Interpretation, WithoutAnAttitudeOnlyTheVerticalForceIsJudged) {
  const logs::Log log = swing(std::string("mode") + kMotors, [](const Swing& s) { return "0" + motors(s); });
  EXPECT_EQ(log.signals.force_axes, (std::array<bool, 3>{false, false, true}));
  EXPECT_EQ(signal(log, "attitude").source, logs::SignalInfo::Source::kDerived);
  EXPECT_LT(axis_error(log), 0.01) << "the thrust axis follows acceleration + g";
  EXPECT_LT(force_error_m_s2(log), 0.1) << "from the velocity";
}

TEST(Interpretation, VelocityAndForceFollowFromAPositionAlone) {
  std::string text = "t,px,py,pz,qx,qy,qz,qw,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 800; ++k) {
    const Swing s(0.01 * k);
    const auto q = s.quaternion();
    text += fmt::format("{:.4f},{:.6f},{:.6f},1,{:.6f},{:.6f},{:.6f},{:.6f}{}\n", s.t, s.x, s.y, q[0], q[1],
                        q[2], q[3], motors(s));
  }
  std::istringstream in(text);
  const logs::Log log = logs::parse_log(in, "swing.csv");
  EXPECT_EQ(signal(log, "velocity").source, logs::SignalInfo::Source::kDerived);
  EXPECT_EQ(log.signals.specific_force, logs::ForceSource::kPosition);
  EXPECT_LT(force_error_m_s2(log), 0.15);
  EXPECT_NEAR(log.samples[400].velocity_m_s[0], Swing(4).vx, 0.01);
}

TEST(Interpretation, TellsRequestedThrustFromAppliedDutyByTheBatterysSag) {
  for (const bool requested : {false, true}) {
    std::string text = "t,px,py,pz,vx,vy,vz,motor.m1,motor.m2,motor.m3,motor.m4,pm.vbat\n";
    for (int k = 0; k < 800; ++k) {
      const double t = 0.01 * k, volt = 4.1 - 0.08 * t, az = 0.3 * std::sin(4 * t),
                   vz = -0.075 * std::cos(4 * t);
      const double load = 1 + az / logs::kGravity_m_s2;
      const double m = 65536 * (requested ? 0.55 * load : std::pow(load, 1 / 1.5) * 0.6 * 4.1 / volt);
      const double z = 1 - 0.01875 * std::sin(4 * t);
      text += fmt::format("{0:.4f},0.01,0,{4:.6f},0,0,{1:.6f},{2:.1f},{2:.1f},{2:.1f},{2:.1f},{3:.4f}\n", t,
                          vz, m, volt, z);
    }
    std::istringstream in(text);
    const logs::Log log = logs::parse_log(in, "sag.csv");
    const bool has_request =
        std::any_of(log.sources.begin(), log.sources.end(),
                    [](const logs::SignalInfo& info) { return info.name == "requested_thrust"; });
    EXPECT_EQ(has_request, requested);
    EXPECT_EQ(log.signals.thrust, logs::ThrustSource::kDuty);
  }
}

TEST(Interpretation, SlowLogsHaveAWindowOfSeveralRecordsAndNoGapsOfTheirOwn) {
  std::string text = "t,px,py,pz,vx,vy,vz,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 100; ++k) {
    const Swing s(0.1 * k);
    text += fmt::format("{:.2f},{:.6f},{:.6f},1,{:.6f},{:.6f},0{}\n", s.t, s.x, s.y, s.vx, s.vy, motors(s));
  }
  std::istringstream in(text);
  const logs::Log log = logs::parse_log(in, "slow.csv");
  EXPECT_EQ(log.health.gaps, 0u);
  EXPECT_GT(log.window_s, 0.4);
  EXPECT_TRUE(log.signals.force_axes[2]);
}

TEST(Interpretation, WrapsOfAPositionInMillimetresAreUndone) {
  std::string text =
      "time_us,stateEstimateZ.x,stateEstimateZ.y,stateEstimateZ.z,stateEstimateZ.vx,stateEstimateZ.vy,"
      "stateEstimateZ.vz\n";
  for (int k = 0; k < 100; ++k) {
    const int x = 32700 + 5 * k;
    text += fmt::format("{},{},0,1000,500,0,0\n", 10000 * k, x > 32767 ? x - 65536 : x);
  }
  std::istringstream in(text);
  const logs::Log log = logs::parse_log(in, "wrap.csv");
  EXPECT_NEAR(log.samples.back().position_m[0], 33.195, 1e-9);
  ASSERT_EQ(log.events.size(), 1u);
  EXPECT_EQ(log.events[0].kind, "wrap");
}

TEST(ColumnsDraft, ReadsTheFileToTheSameSamplesAndGivesEvidence) {
  const std::string path = testing::TempDir() + "swarmcert-columns-draft.csv";
  {
    std::ofstream out(path);
    out << "time,px,py,pz,vx,vy,vz,roll,pitch,yaw,gyro.x,gyro.y,gyro.z,m1,m2,m3,m4,vbat,mood\n";
    for (int k = 0; k < 800; ++k) {
      const Swing s(0.01 * k);
      const double degree = 180 / kPi;
      out << fmt::format("{},{:.6f},{:.6f},1,{:.6f},{:.6f},0,{:.5f},{:.5f},0.0,0.1,0.1,0{},1\n", 10 * k, s.x,
                         s.y, s.vx, s.vy, degree * s.roll, -degree * s.pitch, motors(s));
    }
  }
  const std::string draft = logs::columns_draft(path);
  EXPECT_NE(draft.find("time = { column = \"time\", unit = \"ms\""), std::string::npos) << draft;
  EXPECT_NE(draft.find("roll = { column = \"roll\", unit = \"deg\""), std::string::npos) << draft;
  EXPECT_NE(draft.find("pitch = { column = \"pitch\", unit = \"-deg\""), std::string::npos) << draft;
  EXPECT_NE(draft.find("# not used: mood"), std::string::npos) << draft;
  EXPECT_NE(draft.find("# seen: "), std::string::npos) << draft;
  const logs::Log guessed = logs::read_log(path),
                  stated = logs::read_log(path, logs::parse_columns(draft, "columns.toml"));
  ASSERT_EQ(guessed.samples.size(), stated.samples.size());
  EXPECT_LT(axis_error(stated), 0.01);
  for (std::size_t i = 0; i < stated.samples.size(); i += 50) {
    EXPECT_NEAR(stated.samples[i].time_us, guessed.samples[i].time_us, 1);
    EXPECT_NEAR(stated.samples[i].velocity_m_s[0], guessed.samples[i].velocity_m_s[0], 1e-9);
    EXPECT_NEAR(stated.samples[i].duty[0], guessed.samples[i].duty[0], 1e-9);
  }
  std::filesystem::remove(path);
}

TEST(FlightStory, SplitsALogIntoGroundTakeoffFlightAndLanding) {
  std::string text = "t,px,py,pz,vx,vy,vz,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 1500; ++k) {
    const double t = 0.01 * k;
    // Stands on a table 0.4 m high until 3 s, climbs to 1.4 m within 1 s, and descends from 10 to 11 s.
    const double up = std::clamp(t - 3, 0.0, 1.0) - std::clamp(t - 10, 0.0, 1.0);
    const double speed = (t > 3 && t < 4) ? 1 : (t > 10 && t < 11) ? -1 : 0;
    const bool flies = t > 3 && t < 11;
    text += fmt::format("{0:.3f},0.1,0,{1:.4f},0,0,{2},{3},{3},{3},{3},3.8\n", t, 0.4 + up, speed,
                        flies ? 0.5 : 0.05);
  }
  std::istringstream in(text);
  const logs::FlightStory story = logs::tell(logs::parse_log(in, "hop.csv"));
  std::vector<std::string> names;
  for (const logs::Phase& phase : story.phases) names.push_back(phase.name);
  EXPECT_EQ(names, (std::vector<std::string>{"ground", "takeoff", "flight", "landing", "ground"}));
  EXPECT_NEAR(story.air_s, 8, 0.2);
  EXPECT_EQ(story.no_flight, "");
  EXPECT_FALSE(story.missing.empty());
}

TEST(FlightStory, ALogOfTheGroundIsNoFlight) {
  std::string text = "t,px,py,pz,vx,vy,vz,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 500; ++k) text += fmt::format("{:.2f},0.1,0,0.05,0,0,0,0,0,0,0,4.1\n", 0.01 * k);
  std::istringstream in(text);
  EXPECT_EQ(logs::tell(logs::parse_log(in, "ground.csv")).no_flight, "stands on the ground");
}

std::vector<std::string> logs_of(const std::string& folder, std::size_t most) {
  std::vector<std::string> paths;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(data_path("collections/" + folder))) {
    const std::string path = entry.path().string();
    if (entry.is_regular_file() &&
        (path.find("log") != std::string::npos || entry.path().extension() == ".csv") &&
        entry.path().extension() != ".yaml")
      paths.push_back(path);
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> chosen;
  const std::size_t step = std::max<std::size_t>(1, paths.size() / most);
  for (std::size_t i = 0; i < paths.size(); i += step) chosen.push_back(paths[i]);
  return chosen;
}

/// Returns the fraction of the samples of CrazyPAD logs whose applied duty is within 20 counts of the one computed from
/// request and battery voltage.
double share_within_20_counts(std::size_t most) {
  std::size_t all = 0, near = 0;
  for (const std::string& path : logs_of("crazypad", most)) {
    const logs::RawLog raw = logs::read_raw(path);
    const logs::RawTopic& topic = raw.topics.front();
    for (int m = 1; m <= 4; ++m) {
      const auto& asked = topic.find(fmt::format("motor.m{}", m))->values;
      const auto& applied = topic.find(fmt::format("pwm.m{}_pwm", m))->values;
      const auto& battery = topic.find("pm.vbatMV")->values;
      for (std::size_t i = 0; i < asked.size(); ++i) {
        ++all;
        const double duty = logs::compensated_duty(asked[i] / 65536, battery[i] / 1000);
        near += std::abs(65536 * duty - applied[i]) <= 20 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(all, 10000u);
  return static_cast<double>(near) / static_cast<double>(all);
}

TEST(Collections, DutyFollowsFromRequestAndBatteryWithin20Counts) {
  SWARMCERT_NEEDS_DATA();
  EXPECT_GE(share_within_20_counts(4), 0.99);
}

TEST(Collections, DutyFollowsFromRequestAndBatteryWithin20CountsInEveryLog_slow) {
  SWARMCERT_NEEDS_DATA();
  EXPECT_GE(share_within_20_counts(1000), 0.99);
}

/// Opens logs of each collection under their own names, and checks what can be judged.
void check_collections(std::size_t most) {
  struct Collection {
    const char* folder;
    std::array<bool, 3> axes;
    logs::ThrustSource thrust;
    logs::TorqueUse torque;
    /// 1.3 times the noise floor of the derived acceleration found by independent scripts.
    double noise_m_s2;
  };
  const Collection collections[] = {
      {"crazypad", {false, false, true}, logs::ThrustSource::kDuty, logs::TorqueUse::kMean, 1.3 * 0.13},
      {"crazyswarm2-tools",
       {true, true, true},
       logs::ThrustSource::kForce,
       logs::TorqueUse::kNone,
       1.3 * 0.10},
      {"nanobench", {true, true, true}, logs::ThrustSource::kDuty, logs::TorqueUse::kMean, 1.3 * 0.09}};
  for (const Collection& collection : collections) {
    std::size_t opened = 0;
    for (const std::string& path : logs_of(collection.folder, most)) {
      const logs::Log log = logs::read_log(path);
      EXPECT_EQ(log.signals.force_axes, collection.axes) << path;
      EXPECT_EQ(log.signals.thrust, collection.thrust) << path;
      EXPECT_EQ(log.signals.torque, collection.torque) << path;
      EXPECT_LE(signal(log, "acceleration").noise, collection.noise_m_s2) << path;
      EXPECT_GT(signal(log, "acceleration").noise, 0) << path;
      EXPECT_EQ(logs::tell(log).no_flight, "") << path;
      ++opened;
    }
    EXPECT_GE(opened, 4u) << collection.folder;
  }
}

TEST(Collections, OpenWithTheAxesThatTheirColumnsCarry) {
  SWARMCERT_NEEDS_DATA();
  check_collections(5);
}

TEST(Collections, AllOpenWithTheAxesThatTheirColumnsCarry_slow) {
  SWARMCERT_NEEDS_DATA();
  check_collections(1000);
}

TEST(Collections, TheSimulatedPx4FlightHoversAtTheCommandThatItsEstimatorFinds) {
  SWARMCERT_NEEDS_DATA();
  // The vehicle's own estimator gives 0.488.
  const logs::Log log = logs::read_log(data_path("collections/px4/sample_px4_events.ulg"));
  EXPECT_GE(log.hover_command, 0.47);
  EXPECT_LE(log.hover_command, 0.51);
  EXPECT_EQ(log.signals.force_axes, (std::array<bool, 3>{true, true, true}));
  const logs::FlightStory story = logs::tell(log);
  EXPECT_NEAR(story.air_s, 9, 2);
  EXPECT_EQ(logs::tell(logs::read_log(data_path("collections/px4/sample.ulg"))).no_flight, "never armed");
}

TEST(Collections, NanoBenchsMotorsAreAppliedDutyAndItsGyroscopeIsInRadians) {
  SWARMCERT_NEEDS_DATA();
  for (const std::string& path : logs_of("nanobench", 100)) {
    const logs::Log log = logs::read_log(path);
    EXPECT_EQ(signal(log, "duty").source, logs::SignalInfo::Source::kMeasured) << path;
    double largest = 0;
    for (const logs::Sample& sample : log.samples)
      largest = std::max(largest, std::abs(sample.rates_rad_s[0]));
    EXPECT_GT(largest, 0.3) << path;
    EXPECT_LT(largest, 20) << path << ": in degrees it would be hundreds";
  }
}

}  // namespace
}  // namespace swarmcert::tests

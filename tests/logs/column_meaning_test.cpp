/// Columns mean what the motion confirms: names that fit only in part, clocks that wrap, blocks of several rates.
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "analysis/logs/read_log.h"
#include "dataflash_writer.h"
#include "nn/base/input_error.h"
#include "topics.h"
#include "ulog_writer.h"

namespace swarmcert::tests {
namespace column_meaning {
namespace {

constexpr int kRecords = 600;

/// x = 0.3 sin 3 t, y = 0.2 sin 2 t, z = 1 + 0.1 sin 2.5 t.
struct Flight {
  double t;
  double x() const { return 0.3 * std::sin(3 * t); }
  double y() const { return 0.2 * std::sin(2 * t); }
  double z() const { return 1 + 0.1 * std::sin(2.5 * t); }
  double vx() const { return 0.9 * std::cos(3 * t); }
  double vy() const { return 0.4 * std::cos(2 * t); }
  double vz() const { return 0.25 * std::cos(2.5 * t); }
  std::array<double, 4> xyzw() const {
    const double pitch = std::atan2(-2.7 * std::sin(3 * t), logs::kGravity_m_s2);
    return {0, std::sin(pitch / 2), 0, std::cos(pitch / 2)};
  }
};

/// Three columns and their values.
struct Vector3 {
  std::array<std::string, 3> names;
  std::function<std::array<double, 3>(const Flight&)> values;
};
std::array<std::string, 3> axes(const std::string& before, const std::string& after = "") {
  return {before + "x" + after, before + "y" + after, before + "z" + after};
}
std::array<double, 3> position(const Flight& f) { return {f.x(), f.y(), f.z()}; }
std::array<double, 3> velocity(const Flight& f) { return {f.vx(), f.vy(), f.vz()}; }
std::array<double, 3> decoy(const Flight& f) {
  return {0.7 * std::cos(7 * f.t), 0.6 * std::sin(5 * f.t), 0.2 * std::cos(4 * f.t)};
}

logs::Log read(const std::string& text, const std::string& path = "flight.csv") {
  std::istringstream in(text);
  return logs::parse_log(in, path);
}

std::string table(
    const std::vector<Vector3>& groups,
    const std::function<std::string(int)>& clock = [](int k) { return fmt::format("{:.2f}", 0.01 * k); }) {
  std::string text = "time";
  for (const Vector3& group : groups)
    for (const std::string& name : group.names) text += "," + name;
  for (int k = 0; k < kRecords; ++k) {
    text += "\n" + clock(k);
    for (const Vector3& group : groups)
      for (const double value : group.values(Flight{0.01 * k})) text += fmt::format(",{:.7f}", value);
  }
  return text + "\n";
}

/// Returns the largest distance of the log's positions and velocities from the flight's.
double error_of(const logs::Log& log) {
  double largest = 0;
  const double start_s = log.samples.empty() ? 0 : 1e-6 * log.samples[0].time_us;
  for (const logs::Sample& s : log.samples) {
    const Flight f{1e-6 * s.time_us - start_s};
    for (std::size_t k = 0; k < 3; ++k)
      largest = std::max({largest, std::abs(s.position_m[k] - position(f)[k]),
                          std::abs(s.velocity_m_s[k] - velocity(f)[k])});
  }
  return largest;
}

std::string source(const logs::Log& log, const std::string& name) {
  for (const logs::SignalInfo& info : log.sources)
    if (info.name == name) return info.from;
  return "";
}

TEST(ColumnMeaning, ANameThatFitsAsAWholeComesBeforeOneThatFitsInPart) {
  for (const char* const other : {"ang_vel_", "rate_vel_", "wind_vel_", "payload_vel_"}) {
    const logs::Log log = read(table({{axes(other), decoy}, {axes(""), position}, {axes("v"), velocity}}));
    EXPECT_LT(error_of(log), 1e-5) << other;
  }
}

TEST(ColumnMeaning, WhatTheMotionContradictsIsNotUsedAndSaid) {
  for (const char* const other : {"wind_vel_", "payload_vel_"}) {
    const logs::Log log = read(table({{axes(""), position}, {axes(other), decoy}}));
    EXPECT_LT(error_of(log), 0.1) << other << ": the velocity is derived from the position";
    EXPECT_NE(fmt::format("{}", fmt::join(log.interpretation, "\n")).find(other), std::string::npos);
  }
  EXPECT_THROW(read(table({{axes("wind_vel_"), decoy}})), files::InputError) << "nothing confirms it";
  const logs::Log log = read(table({{axes("ang_acc_"), decoy}, {axes(""), position}, {axes("v"), velocity}}));
  EXPECT_EQ(source(log, "specific_force").find("ang_acc"), std::string::npos);
}

TEST(ColumnMeaning, AnRBehindTheNameOfAnotherColumnMeansItsSetPoint) {
  const auto ahead_of = [](const auto& of) {
    return [of](const Flight& f) { return of(Flight{f.t + 0.1}); };
  };
  const Vector3 wished = {axes("", "_r"), ahead_of(position)},
                wished_v = {axes("v", "_r"), ahead_of(velocity)};
  const logs::Log log = read(table({{axes(""), position}, {axes("v"), velocity}, wished, wished_v}));
  EXPECT_LT(error_of(log), 1e-5) << "the set points are not taken for the vehicle";
  EXPECT_TRUE(log.signals.targets);
  EXPECT_EQ(source(log, "target_position"), "x_r, y_r, z_r");
  EXPECT_EQ(source(log, "target_velocity"), "vx_r, vy_r, vz_r");
  EXPECT_FALSE(read(table({{axes("", "_r"), position}, {axes("v"), velocity}})).signals.targets)
      << "no column that these would be the set points of";
}

TEST(ColumnMeaning, WrappedClocksGoOn) {
  const std::vector<Vector3> groups = {{axes(""), position}, {axes("v"), velocity}};
  // 2^24 and 2^32 milliseconds, 2^32 microseconds; the clock wraps after 3 s.
  for (const auto& [range, per_s] : {std::pair{16777216.0, 1e3}, {4294967296.0, 1e3}, {4294967296.0, 1e6}}) {
    const double whole = range, each = per_s;
    const logs::Log log = read(table(groups, [whole, each](int k) {
      return fmt::format("{:.0f}", std::fmod(whole - 3 * each + 0.01 * each * k, whole));
    }));
    EXPECT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords)) << range;
    EXPECT_LT(error_of(log), 1e-4) << range;
  }
}

TEST(ColumnMeaning, BlocksOfSeveralRatesJoinedWithBlanksAreRead) {
  std::string text = "time,x,y,z,vx,vy,vz,vbat\n";
  for (int k = 0; k < kRecords; ++k) {
    const Flight f{0.01 * k};
    text += fmt::format("{:.3f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},\n", f.t, f.x(), f.y(), f.z(),
                        f.vx(), f.vy(), f.vz());
    if (k % 10 == 0) text += fmt::format("{:.3f},,,,,,,{:.2f}\n", f.t + 0.001, 4 - 0.01 * f.t);
  }
  const logs::Log log = read(text);
  EXPECT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords));
  EXPECT_LT(error_of(log), 1e-5);
  EXPECT_NEAR(log.samples[300].battery_V, 3.97, 1e-3);
}

TEST(ColumnMeaning, RecordsWithoutATimeAreCountedAndTheOthersRead) {
  std::string text = "time,x,y,z,vx,vy,vz\n";
  for (int k = 0; k < kRecords; ++k) {
    const Flight f{0.01 * k};
    text += k % 5 == 1 ? "" : fmt::format("{:.3f}", f.t);
    text += fmt::format(",{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f}\n", f.x(), f.y(), f.z(), f.vx(), f.vy(),
                        f.vz());
  }
  const logs::Log log = read(text);
  EXPECT_EQ(log.samples.size(), kRecords * 4u / 5);
  EXPECT_EQ(log.health.not_finite, kRecords / 5);
  EXPECT_LT(error_of(log), 1e-5);
}

TEST(ColumnMeaning, AnArrayWithAnElementZeroIsCountedFromZero) {
  const Vector3 low{{"motor[0]", "motor[1]", "motor[2]"}, [](const Flight&) {
                      return std::array<double, 3>{10000, 20000, 30000};
                    }};
  const Vector3 high{{"motor[3]", "motor[4]", "vbat"}, [](const Flight&) {
                       return std::array<double, 3>{40000, 0, 4};
                     }};
  const logs::Log log = read(table({{axes(""), position}, {axes("v"), velocity}, low, high}));
  ASSERT_FALSE(log.samples.empty());
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(log.samples[0].duty[k], 10000.0 * static_cast<double>(k + 1) / 65536, 1e-9) << k;
}

TEST(ColumnMeaning, QuotedNamesMayContainTheSeparator) {
  const logs::Log log = read(
      table({{{"\"x, position\"", "\"y, position\"", "\"z, position\""}, position}, {axes("v"), velocity}}));
  EXPECT_LT(error_of(log), 1e-5);
}

TEST(ColumnMeaning, BlanksSeparateTheColumnsOfATrajectory) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (int k = 0; k < kRecords; ++k) {
    const Flight f{0.01 * k};
    const std::array<double, 4> q = f.xyzw();
    text += fmt::format("{:.4f} {:.7f}  {:.7f} {:.7f} {:.9f} {:.9f} {:.9f} {:.9f}\n", 1.7e9 + f.t, f.x(),
                        f.y(), f.z(), q[0], q[1], q[2], q[3]);
  }
  const logs::Log log = read(text, "flight.txt");
  ASSERT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords));
  EXPECT_TRUE(log.signals.attitude);
  EXPECT_LT(error_of(log), 0.1);
}

TEST(ColumnMeaning, AQuaternionThatLaysTheVehicleOnItsSideHasTheOtherOrder) {
  for (const bool w_first : {false, true}) {
    std::string text = "time,x,y,z,vx,vy,vz,qx,qy,qz,qw\n";
    for (int k = 0; k < kRecords; ++k) {
      const Flight f{0.01 * k};
      std::array<double, 4> q = f.xyzw();
      if (w_first) std::rotate(q.begin(), q.begin() + 3, q.end());
      text += fmt::format("{:.2f},{},{},{},{},{},{},{},{},{},{}\n", f.t, f.x(), f.y(), f.z(), f.vx(), f.vy(),
                          f.vz(), q[0], q[1], q[2], q[3]);
    }
    const logs::Log log = read(text);
    ASSERT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords));
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(log.samples[100].attitude.xyzw()[k], Flight{1}.xyzw()[k], 1e-9) << w_first << k;
  }
}

/// Returns a ULog of the flight as PX4 writes it, with the duties of an output driver beside the motor commands.
/// @param invalid records at the start whose x and y the estimator does not call valid
/// @param dead_reckoning as the estimator says throughout
std::string px4_flight(int invalid, std::uint8_t vehicle_type, const std::string& parameters = "",
                       bool dead_reckoning = false) {
  std::string text =
      ulog_head() + ulog_flags(0, 0) + parameters +
      ulog_format(
          "vehicle_local_position:uint64_t timestamp;float x;float y;float z;float vx;float vy;"
          "float vz;uint8_t xy_valid;uint8_t v_xy_valid;"
          "uint8_t dead_reckoning;") +
      ulog_format("actuator_motors:uint64_t timestamp;float[4] control;") +
      ulog_format("px4io_status:uint64_t timestamp;uint16_t[8] pwm;") +
      ulog_format("vehicle_status:uint64_t timestamp;uint8_t vehicle_type;") +
      ulog_subscription(1, "vehicle_local_position") + ulog_subscription(2, "actuator_motors") +
      ulog_subscription(3, "px4io_status") + ulog_subscription(4, "vehicle_status");
  const auto floats = [](const std::vector<double>& values) {
    std::string bytes;
    for (const double value : values) bytes += bytes_of(static_cast<float>(value));
    return bytes;
  };
  for (int k = 0; k < kRecords; ++k) {
    const Flight f{0.01 * k};
    const std::uint64_t time_us = 5'000'000 + 10'000 * static_cast<std::uint64_t>(k);
    text += ulog_record(1, time_us,
                        floats({f.x(), -f.y(), -f.z(), f.vx(), -f.vy(), -f.vz()}) +
                            std::string(2, k < invalid ? '\0' : '\1') +
                            std::string(1, dead_reckoning ? '\1' : '\0'));
    text += ulog_record(2, time_us, floats({0.45, 0.45, 0.45, 0.45}));
    if (k % 100 != 0) continue;
    std::string pwm;
    for (int n = 0; n < 8; ++n) pwm += bytes_of(static_cast<std::uint16_t>(n < 4 ? 1300 + k / 10 : 0));
    text += ulog_record(3, time_us, pwm) +
            ulog_record(4, time_us, std::string(1, static_cast<char>(vehicle_type)));
  }
  return text;
}

TEST(ColumnMeaning, OfPx4TheMotorCommandsAreUsedAndNotTheStateOfAnOutputDriver) {
  const logs::Log log = read(px4_flight(0, 1), "flight.ulg");
  EXPECT_NEAR(log.hover_command, 0.45, 0.01);
  EXPECT_TRUE(log.signals.force);
}

TEST(ColumnMeaning, WhatTheEstimatorCallsInvalidIsNotJudged) {
  for (const auto& [text, why] : {std::pair{px4_flight(kRecords, 1), "xy_valid = 0"},
                                  std::pair{px4_flight(0, 1, "", true), "dead_reckoning = 1"}}) {
    const logs::Log log = read(text, "flight.ulg");
    EXPECT_EQ(log.signals.force_axes, (std::array<bool, 3>{false, false, true})) << why;
    EXPECT_NE(fmt::format("{}", fmt::join(log.interpretation, "\n")).find(why), std::string::npos) << why;
  }
}

TEST(ColumnMeaning, RecordsThatTheEstimatorCallsInvalidForATimeAreLeftOutAndCountedAndNoDamage) {
  const logs::Log log = read(px4_flight(120, 1), "flight.ulg");
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_EQ(log.left_out[0].name, "vehicle_local_position");
  EXPECT_EQ(log.left_out[0].records, 120u);
  EXPECT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords - 120));
  EXPECT_TRUE(log.signals.position);
  EXPECT_TRUE(logs::is_sound(log.health));
}

TEST(ColumnMeaning, AFixedWingHasNoRotorsToJudge) {
  const logs::Log log = read(px4_flight(0, 2), "flight.ulg");
  EXPECT_FALSE(log.signals.force);
  EXPECT_NE(log.signals.force_lacks.find("fixed wing"), std::string::npos) << log.signals.force_lacks;
}

TEST(ColumnMeaning, TheAirframeNamesTheKindOfAVehicleWithoutRotors) {
  const auto kind = [](std::uint8_t type, std::int32_t airframe) {
    return read(px4_flight(0, type, ulog_keyed('P', "int32_t SYS_AUTOSTART", bytes_of(airframe))),
                "flight.ulg")
        .signals.not_multirotor;
  };
  EXPECT_EQ(kind(3, 3000), "fixed wing") << "a flying wing";
  EXPECT_EQ(kind(0, 50000), "rover");
  EXPECT_EQ(kind(3, 4001), "rover") << "the airframe of a quadrotor says nothing against the type";
  EXPECT_EQ(kind(1, 3000), "") << "it flies on its rotors";
}

TEST(ColumnMeaning, InstancesOfDataflashWithoutUnitsAreKnownByTheirFields) {
  std::string bytes = dataflash_format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
                      dataflash_format(11, 20, "XKF1", "QBff", "TimeUS,C,VN,PD");
  for (int k = 0; k < 20; ++k) bytes += dataflash_state(static_cast<std::uint8_t>(k % 2), 1, 2);
  std::istringstream in(bytes);
  const logs::RawLog log = logs::parse_raw(in, "flight.bin");
  EXPECT_EQ(topic_of(log, "XKF1", 0).time_s.size(), 10U);
  EXPECT_EQ(topic_of(log, "XKF1", 1).time_s.size(), 10U);
}

}  // namespace
}  // namespace column_meaning
}  // namespace swarmcert::tests

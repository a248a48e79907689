/// Logs as written by other programs: a bag from another writer, ArduPilot messages as defined by its releases, and
/// velocities whose frame no name states.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "analysis/logs/interpretation.h"
#include "analysis/logs/log.h"
#include "analysis/logs/read_log.h"
#include "data.h"
#include "logs/dataflash_writer.h"
#include "logs/raw_log_invariant.h"
#include "logs/topics.h"

namespace swarmcert::tests {
namespace {

/// Expects the column to be a function of the message's number.
void expect_column(const logs::RawLog& log, const std::string& topic, const std::string& column,
                   const std::function<double(int)>& value) {
  const std::vector<double> values = values_in(log, topic, column);
  ASSERT_EQ(values.size(), 4u) << topic << " " << column;
  for (int k = 0; k < 4; ++k)
    EXPECT_EQ(values[static_cast<std::size_t>(k)], value(k)) << topic << " " << column << " " << k;
}

/// The numbers are those written by the generator of this file, and found in it by another reader.
TEST(ForeignLogs, ABagOfAnotherWriterGivesItsNumbers) {
  const logs::RawLog log = logs::read_raw(source_path("tests/logs/data/reference_sqlite.db3"));
  EXPECT_EQ(broken_rule(log), "");
  EXPECT_EQ(log.format, "rosbag2 sqlite");
  EXPECT_EQ(log.health.damaged_blocks, 0u);
  EXPECT_EQ(log.health.records, 26u) << "six topics of four messages, two of which name two vehicles";
  ASSERT_EQ(log.left_out.size(), 2u);
  EXPECT_EQ(log.left_out[0].name, "/cf1/status");
  EXPECT_EQ(log.left_out[1].name, "/cf1/joint");
  const auto number = [](int k) { return static_cast<double>(k); };
  const auto zero = [](int) { return 0.0; };
  expect_column(log, "/cf1/pose", "pose.position.x", number);
  expect_column(log, "/cf1/pose", "pose.position.y", [](int k) { return -k / 3.0; });
  expect_column(log, "/cf1/pose", "pose.position.z", [](int k) { return 1e-300 * k; });
  expect_column(log, "/cf1/pose", "pose.orientation.w", [](int) { return 0.8; });
  EXPECT_NEAR(topic_of(log, "/cf1/pose").time_s[3], 1700000000.153456789, 1e-6);
  // These numbers follow texts of 3, 6, 9 and 3 characters.
  expect_column(log, "/cf1/odom", "pose.pose.position.z", [](int k) { return 3.0 * k; });
  expect_column(log, "/cf1/odom", "pose.pose.orientation.y", [](int) { return -0.5; });
  expect_column(log, "/cf1/odom", "twist.twist.linear.x", [](int k) { return k / 8.0; });
  expect_column(log, "/cf1/odom", "twist.twist.angular.y", [](int k) { return k / 16.0; });
  expect_column(log, "/cf1/imu", "angular_velocity.x", number);
  expect_column(log, "/cf1/imu", "linear_acceleration.z", [](int) { return 9.8125; });
  expect_column(log, "/cf1/battery", "voltage", [](int k) { return 3.75 + k / 64.0; });
  expect_column(log, "/cf1/battery", "current", [](int k) { return -k / 4.0; });
  expect_column(log, "/cf1/velocity", "twist.linear.z", [](int k) { return k + 2.0; });
  expect_column(log, "/tf[cf1]", "transform.translation.x", number);
  expect_column(log, "/tf[cf1]", "transform.translation.y", zero);
  EXPECT_EQ(values_in(log, "/tf[cf2]", "transform.translation.y"), (std::vector<double>{1, 1}));
}

/// An angular velocity is not a velocity, and an orientation that an IMU leaves empty is not the attitude.
TEST(ForeignLogs, SignalsOfABagComeFromTheMessagesThatCarryThem) {
  const logs::Log log = logs::read_log(source_path("tests/logs/data/reference_sqlite.db3"));
  std::map<std::string, std::string> from;
  for (const logs::SignalInfo& info : log.sources) from[info.name] = info.from;
  EXPECT_EQ(from["velocity"].rfind("/cf1/odom: twist.twist.linear.x", 0), 0u) << from["velocity"];
  EXPECT_EQ(from["rates"].rfind("/cf1/imu: angular_velocity.x", 0), 0u) << from["rates"];
  EXPECT_EQ(from["attitude"].rfind("/cf1/pose: pose.orientation.x", 0), 0u) << from["attitude"];
  EXPECT_EQ(from["battery"], "/cf1/battery: voltage");
}

/// A vehicle that moves sideways with its nose turned by 1 rad, with velocities along the axes of the `body` or of the
/// world.
logs::Log turned_flight(bool body, bool has_position = true) {
  std::string text = "t,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w";
  text += ",twist.linear.x,twist.linear.y,twist.linear.z";
  text += has_position ? ",pose.position.x,pose.position.y,pose.position.z\n" : "\n";
  for (int k = 0; k < 400; ++k) {
    const double t = 0.01 * k, vx = 0.9 * std::cos(3 * t), vy = 0.4 * std::cos(2 * t), yaw = 1;
    // The thrust axis leans along the acceleration; before that the nose is turned.
    const double ax = -2.7 * std::sin(3 * t), ay = -0.8 * std::sin(2 * t), lean = std::hypot(ax, ay);
    const double half = std::atan2(lean, logs::kGravity_m_s2) / 2, s = lean > 0 ? std::sin(half) / lean : 0;
    const double qx = -s * ay, qy = s * ax, qw = std::cos(half), c2 = std::cos(yaw / 2),
                 s2 = std::sin(yaw / 2);
    const logs::Attitude q{qx * c2 + qy * s2, qy * c2 - qx * s2, qw * s2, qw * c2};
    logs::Vector v = {vx, vy, 0};
    const auto R = q.rotation();
    for (std::size_t j = 0; j < 3 && body; ++j) v[j] = R[0][j] * vx + R[1][j] * vy;
    text += fmt::format("{:.3f},{:.12f},{:.12f},{:.12f},{:.12f},{:.9f},{:.9f},{:.9f}", t, q.x, q.y, q.z, q.w,
                        v[0], v[1], v[2]);
    text +=
        has_position ? fmt::format(",{:.9f},{:.9f},1\n", 0.3 * std::sin(3 * t), 0.2 * std::sin(2 * t)) : "\n";
  }
  std::istringstream in(text);
  return logs::parse_log(in, "turned.csv");
}

TEST(ForeignLogs, TheFrameOfATwistFollowsFromThePositions) {
  for (const bool body : {false, true}) {
    const logs::Log log = turned_flight(body);
    ASSERT_EQ(log.samples.size(), 400u);
    for (std::size_t i = 0; i < log.samples.size(); i += 20) {
      const double t = 1e-6 * log.samples[i].time_us;
      EXPECT_NEAR(log.samples[i].velocity_m_s[0], 0.9 * std::cos(3 * t), 1e-6) << body;
      EXPECT_NEAR(log.samples[i].velocity_m_s[1], 0.4 * std::cos(2 * t), 1e-6) << body;
    }
    ASSERT_FALSE(log.interpretation.empty());
    EXPECT_NE(log.interpretation[0].find(body ? "axes of the body" : "axes of the world"), std::string::npos);
  }
}

TEST(ForeignLogs, ATwistWithoutPositionsIsTakenInTheWorldAndSaysSo) {
  const logs::Log log = turned_flight(true, false);
  ASSERT_FALSE(log.interpretation.empty());
  EXPECT_NE(log.interpretation[0].find("cannot be checked"), std::string::npos) << log.interpretation[0];
}

/// A topic of a PX4 log at 50 Hz for 4 s; `value` gives column c at record k.
logs::RawTopic px4_topic(const std::string& name, int instance, const std::vector<std::string>& columns,
                         const std::function<double(std::size_t c, int k)>& value) {
  logs::RawTopic topic;
  topic.name = topic.type = name;
  topic.instance = instance;
  for (int k = 0; k < 200; ++k) topic.time_s.push_back(10 + 0.02 * k);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    topic.columns.push_back({columns[c], {}});
    for (int k = 0; k < 200; ++k) topic.columns.back().values.push_back(value(c, k));
  }
  return topic;
}

/// An absent battery and outputs without motors come first, as on boards with two power ports and an IO chip.
TEST(ForeignLogs, OfSeveralInstancesTheFirstThatChangesIsInUse) {
  logs::RawLog raw;
  raw.path = "flight.ulg";
  raw.format = "ulog";
  const std::vector<std::string> outputs = {"timestamp", "output[0]", "output[1]", "output[2]", "output[3]"};
  raw.topics = {
      px4_topic("battery_status", 0, {"timestamp", "voltage_v"},
                [](std::size_t c, int k) { return c == 0 ? k : 0; }),
      px4_topic("battery_status", 1, {"timestamp", "voltage_v"},
                [](std::size_t c, int k) { return c == 0 ? k : 16 - 0.001 * k; }),
      px4_topic("actuator_outputs", 0, outputs, [](std::size_t c, int k) { return c == 0 ? k : 900; }),
      px4_topic(
          "actuator_outputs", 1, outputs,
          [](std::size_t c, int k) { return c == 0 ? k : 1400 + 10.0 * static_cast<double>(c) + k % 3; }),
      px4_topic("vehicle_local_position", 0, {"x", "y", "z", "vx", "vy", "vz"}, [](std::size_t c, int k) {
        return c == 2 ? -1.5 : c == 0 ? 0.01 * k : c == 3 ? 0.5 : 0;
      })};
  const logs::Log log = logs::interpret(raw, {});
  EXPECT_EQ(log.signals.motor_commands, 4);
  ASSERT_EQ(log.samples.size(), 200u);
  EXPECT_NEAR(log.samples[100].battery_V, 15.9, 1e-9);
  EXPECT_NEAR(log.samples[100].motor_command[3], 0.441, 1e-6);
  EXPECT_NEAR(log.samples[100].position_m[2], 1.5, 1e-12);
}

/// Formats, units and multipliers as defined by ArduPilot since release 4.1 (libraries/*/LogStructure.h).
std::string ardupilot_definitions() {
  return dataflash_definitions() +
         dataflash_format(20, 56, "XKF1", "QBccCfffffffccce",
                          "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH") +
         dataflash_format(21, 36, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ") +
         dataflash_format(22, 27, "ATT", "QccccCCCC",
                          "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw") +
         dataflash_format(23, 39, "RCOU", "QHHHHHHHHHHHHHH",
                          "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14") +
         dataflash_format(24, 20, "BAT", "QBff", "TimeUS,Instance,Volt,VoltR") +
         dataflash_format(25, 18, "ARM", "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method") +
         dataflash_unit('s', "s") + dataflash_unit('d', "deg") + dataflash_unit('h', "degheading") +
         dataflash_unit('n', "m/s") + dataflash_unit('m', "m") + dataflash_unit('o', "m/s/s") +
         dataflash_unit('E', "rad/s") + dataflash_unit('Y', "us") + dataflash_unit('v', "V") +
         dataflash_unit('#', "instance") + dataflash_multiplier('-', 0) + dataflash_multiplier('?', 1) +
         dataflash_multiplier('0', 1) + dataflash_multiplier('B', 1e-2) + dataflash_multiplier('F', 1e-6) +
         dataflash_units(20, "s#ddhnnnnmmmkkkm", "F-BBB0000000BBBB") +
         dataflash_units(21, "s#EEEooo", "F-000000") + dataflash_units(22, "sddddhhdh", "FBBBBBBBB") +
         dataflash_units(23, "sYYYYYYYYYYYYYY", "F--------------") + dataflash_units(24, "s#vv", "F-00");
}

std::string hundredths(double value) { return bytes_of(static_cast<std::int16_t>(std::lround(100 * value))); }
std::string floats(std::initializer_list<double> values) {
  std::string bytes;
  for (const double value : values) bytes += bytes_of(static_cast<float>(value));
  return bytes;
}

/// North 0.3 sin 3 t, down -1 - 0.1 sin 2 t, at 100 Hz for 4 s, with invalid values from a second estimator core and a
/// second IMU; motors 1 to 4 on outputs 9 to 12, between 1100 and 1900 us.
std::string ardupilot_flight(bool states_outputs) {
  std::string log = ardupilot_definitions();
  for (int n = 1; n <= 4 && states_outputs; ++n)
    log += dataflash_parameter("SERVO" + std::to_string(8 + n) + "_FUNCTION", static_cast<float>(32 + n), 0);
  log +=
      dataflash_parameter("MOT_PWM_MIN", 1100, 1000) + dataflash_parameter("MOT_PWM_MAX", 1900, 2000) +
      dataflash_message(25, bytes_of(std::uint64_t{5'000'000}) + '\1' + bytes_of(std::uint32_t{0}) + "\1\1");
  for (int k = 0; k < 400; ++k) {
    const double t = 0.01 * k, an = -2.7 * std::sin(3 * t), ad = 0.4 * std::sin(2 * t),
                 pitch = std::atan2(-an, 9.80665);
    const std::string time = bytes_of(5'000'000 + 10'000 * static_cast<std::uint64_t>(k));
    for (const char core : {'\0', '\1'}) {
      const double scale = core == 0 ? 1 : 7;
      log += dataflash_message(
          20, time + core + hundredths(0) + hundredths(0) + hundredths(0) +
                  floats({scale * 0.9 * std::cos(3 * t), 0, -scale * 0.2 * std::cos(2 * t), 0,
                          scale * 0.3 * std::sin(3 * t), 0, -1 - 0.1 * std::sin(2 * t)}) +
                  hundredths(0) + hundredths(0) + hundredths(0) + bytes_of(std::int32_t{0}));
      log +=
          dataflash_message(21, time + core + floats({0, 0, 0, 0, 0, -scale * std::hypot(an, 9.80665 - ad)}));
    }
    log += dataflash_message(22, time + hundredths(0) + hundredths(0) + hundredths(0) +
                                     hundredths(pitch * 180 / 3.14159265358979) + hundredths(0) +
                                     hundredths(0) + hundredths(0) + hundredths(0));
    std::string outputs;
    for (int c = 1; c <= 14; ++c)
      outputs += bytes_of(static_cast<std::uint16_t>(c < 9 ? 1500 + k % 2 : c < 13 ? 1400 + c : 0));
    log += dataflash_message(23, time + outputs) + dataflash_message(24, time + '\0' + floats({15.5, 15.6}));
  }
  return log;
}

TEST(ForeignLogs, AnArduPilotFlightIsJudgedUpwardsFromTheMotorsThatItsParametersName) {
  std::istringstream in(ardupilot_flight(true));
  const logs::Log log = logs::parse_log(in, "00000012.BIN");
  EXPECT_EQ(log.format, "ardupilot");
  EXPECT_EQ(log.armed, logs::Armed::kYes);
  EXPECT_EQ(log.signals.motor_commands, 4);
  EXPECT_EQ(log.signals.force_axes, (std::array<bool, 3>{true, true, true}));
  ASSERT_GT(log.samples.size(), 350u);
  for (std::size_t i = 20; i < log.samples.size(); i += 30) {
    const logs::Sample& sample = log.samples[i];
    const double t = 1e-6 * sample.time_us - 5;
    EXPECT_NEAR(sample.position_m[0], 0.3 * std::sin(3 * t), 1e-3);
    EXPECT_NEAR(sample.position_m[2], 1 + 0.1 * std::sin(2 * t), 1e-3);
    EXPECT_NEAR(sample.velocity_m_s[2], 0.2 * std::cos(2 * t), 1e-3);
    EXPECT_NEAR(sample.battery_V, 15.5, 1e-6);
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(sample.motor_command[k], (309.0 + static_cast<double>(k)) / 800, 1e-6) << k;
  }
}

TEST(ForeignLogs, WithoutParametersTheFirstDrivenOutputsOfArduPilotAreItsMotors) {
  std::istringstream in(ardupilot_flight(false));
  EXPECT_EQ(logs::parse_log(in, "00000013.BIN").signals.motor_commands, 8);
}

}  // namespace
}  // namespace swarmcert::tests

#include "analysis/logs/formats/ros_topic.h"

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/logs/formats/ros_types.h"
#include "logs/cdr_writer.h"
#include "logs/raw_log_invariant.h"
#include "logs/topics.h"

namespace swarmcert::tests {
namespace {

/// Returns a topic "/t" of `type` with `messages` at 0, 1, 2, ... seconds; `definition` may be empty.
logs::RawLog messages_of(const std::string& type, const std::string& definition,
                         const std::vector<std::string>& messages) {
  logs::RawLog log;
  log.format = "test";
  std::string fault;
  const auto layout = logs::ros_layout(type, definition, fault);
  if (!layout) {
    log.left_out.push_back({"/t", fault, messages.size()});
    return log;
  }
  logs::RosBudget budget;
  logs::RosTopic topic("/t", layout, budget);
  for (std::size_t i = 0; i < messages.size(); ++i) topic.add(static_cast<double>(i), messages[i]);
  topic.move_to(log);
  EXPECT_EQ(broken_rule(log), "");
  return log;
}

TEST(RosTopic, ReadsBothByteOrdersAndVersionsOfTheEncoding) {
  const char* const definition = "uint8 a\nfloat64 b\nint16 c\nuint64 d\nfloat32 e\n";
  for (const bool is_big_endian : {false, true}) {
    for (const bool is_version_2 : {false, true}) {
      CdrWriter writer(is_big_endian, is_version_2);
      writer.number(std::uint8_t{7})
          .number(-2.5)
          .number(std::int16_t{-3})
          .number(std::uint64_t{5'000'000'000})
          .number(0.5f);
      const logs::RawLog log = messages_of("p/T", definition, {writer.message()});
      const logs::RawTopic& topic = topic_of(log, "/t");
      EXPECT_EQ(topic.type, "p/msg/T");
      std::vector<double> values;
      for (const std::string& name : column_names(topic)) values.push_back(values_of(topic, name).at(0));
      EXPECT_EQ(values, (std::vector<double>{7, -2.5, -3, 5e9, 0.5})) << is_big_endian << is_version_2;
    }
  }
}

TEST(RosTopic, UnderstandsTheLanguageOfDefinitions) {
  const std::string definition =
      "# a comment\n\nuint8 CONSTANT=3\nstring WORDS = \"a # b\"\nfloat64 TAU=6.28 # another\n"
      "int32 a 5 # with a default\nint32[2] b [1, 2]\nint32[<=3] c\nstring<=9 d 'text'\nstring<=9[<=2] e\n"
      "\tbool  f   true\r\nbyte g\nchar h\nstd_msgs/Header header\nInner inner\nother/msg/Inner outer\n"
      "=====\nMSG: p/Inner\nuint8 x\n=====\nMSG: other/Inner\nuint16 y\n";
  CdrWriter writer;
  writer.number(std::int32_t{-1})
      .number(std::int32_t{2})
      .number(std::int32_t{3})
      .count(1)
      .number(std::int32_t{4});
  writer.text("word")
      .count(2)
      .text("x")
      .text("yz")
      .number(std::uint8_t{1})
      .number(std::uint8_t{8})
      .number(std::uint8_t{9});
  writer.header(3, 500'000'000, "map").number(std::uint8_t{10}).number(std::uint16_t{11});
  const logs::RawLog log = messages_of("p/msg/T", definition, {writer.message()});
  ASSERT_TRUE(log.left_out.empty()) << log.left_out[0].why;
  const logs::RawTopic& topic = topic_of(log, "/t");
  EXPECT_EQ(column_names(topic), (std::vector<std::string>{"a", "b[0]", "b[1]", "c[0]", "f", "g", "h",
                                                           "header.stamp", "inner.x", "outer.y"}));
  EXPECT_EQ(values_of(topic, "header.stamp"), std::vector<double>{3.5});
  EXPECT_EQ(values_of(topic, "outer.y"), std::vector<double>{11});
}

TEST(RosTopic, RefusesDefinitionsThatCannotBe) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"float64", "a line that cannot be used"},
      {"wstring x", "a line that cannot be used"},
      {"float64[0] x", "a line that cannot be used"},
      {"float64[99999999999] x", "a line that cannot be used"},
      {"float64[-1] x", "a line that cannot be used"},
      {"unknown/Type x", "does not define unknown/Type"},
      {"float64 x\nuint8 x", "two fields \"x\""},
      {"T x", "contains itself"},
      {"A x\n===\nMSG: p/A\nB x\n===\nMSG: p/B\nA x\n", "contains itself"},
      {"uint8 x\n=====\nno name\n", "no \"MSG:\""},
      {"uint8 x\n=====", "no \"MSG:\""},  // cut behind the line of "="
      {std::string(std::size_t{2} << 20, '\n'), "over 1 MiB"},
  };
  for (const auto& [definition, reason] : cases) {
    const logs::RawLog log = messages_of("p/T", definition, {"message"});
    ASSERT_EQ(log.left_out.size(), 1u) << reason;
    EXPECT_NE(log.left_out[0].why.find(reason), std::string::npos) << log.left_out[0].why;
  }
}

TEST(RosTopic, NestingIsLimited) {
  std::string definition = "T0 x\n";
  for (int i = 0; i < 40; ++i)
    definition += "===\nMSG: p/T" + std::to_string(i) + "\nT" + std::to_string(i + 1) + " x\n";
  definition += "===\nMSG: p/T40\nuint8 x\n";
  const logs::RawLog log = messages_of("p/T", definition, {"message"});
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_NE(log.left_out[0].why.find("nested too deeply"), std::string::npos) << log.left_out[0].why;
}

TEST(RosTopic, ArraysThatVaryInLengthAreNotANumberWhereTheyLackAnElement) {
  std::vector<std::string> messages;
  for (const int count : {1, 0, 3}) {
    CdrWriter writer;
    writer.count(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) writer.number(static_cast<float>(i + 1));
    messages.push_back(writer.message());
  }
  const logs::RawLog log = messages_of("p/T", "float32[] values\n", messages);
  const logs::RawTopic& topic = topic_of(log, "/t");
  const auto text = [&](const std::string& column) {
    std::string result;
    for (const double value : values_of(topic, column))
      result += std::isnan(value) ? "-" : std::to_string(std::lround(value));
    return result;
  };
  EXPECT_EQ(text("values[0]"), "1-1");
  EXPECT_EQ(text("values[2]"), "--3");
}

TEST(RosTopic, TransformsAndNamedPosesBecomeATopicForEachName) {
  const auto transforms = [](const std::vector<std::pair<std::string, double>>& vehicles) {
    CdrWriter writer;
    writer.count(vehicles.size());
    for (const auto& [name, x] : vehicles)
      writer.header(1, 0, "world").text(name).doubles(x, 0, 0, 0, 0, 0, 1);
    return writer.message();
  };
  const logs::RawLog log = messages_of(
      "tf2_msgs/msg/TFMessage", "",
      {transforms({{"cf1", 1}, {"cf2", 10}}), transforms({{"cf2", 20}}), transforms({{"cf1", 3}})});
  ASSERT_EQ(log.topics.size(), 2u);
  EXPECT_EQ(topic_of(log, "/t[cf1]").type, "geometry_msgs/msg/TransformStamped");
  EXPECT_EQ(topic_of(log, "/t[cf1]").time_s, (std::vector<double>{0, 2}));
  EXPECT_EQ(values_in(log, "/t[cf1]", "transform.translation.x"), (std::vector<double>{1, 3}));
  EXPECT_EQ(values_in(log, "/t[cf2]", "transform.translation.x"), (std::vector<double>{10, 20}));

  CdrWriter poses;
  poses.header(1, 0, "world").count(1).text("cf7").doubles(1, 2, 3, 0, 0, 0, 1);
  const logs::RawLog named =
      messages_of("motion_capture_tracking_interfaces/msg/NamedPoseArray", "", {poses.message()});
  EXPECT_EQ(values_in(named, "/t[cf7]", "pose.position.z"), std::vector<double>{3});
  EXPECT_EQ(values_in(named, "/t", "header.stamp"), std::vector<double>{1});
}

TEST(RosTopic, KnowsTheMessagesOfFlightsWithoutADefinition) {
  for (const char* const type :
       {"geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu",
        "geometry_msgs/msg/TwistStamped", "geometry_msgs/msg/TransformStamped",
        "crazyflie_interfaces/msg/LogDataGeneric", "tf2_msgs/msg/TFMessage",
        "px4_msgs/msg/VehicleLocalPosition", "px4_msgs/msg/VehicleAttitude", "px4_msgs/msg/SensorCombined",
        "px4_msgs/msg/ActuatorMotors", "px4_msgs/msg/BatteryStatus"}) {
    std::string fault;
    EXPECT_NE(logs::ros_layout(type, "", fault), nullptr) << type << ": " << fault;
  }
  CdrWriter imu;
  imu.header(1, 0, "body").doubles(0, 0, 0, 1);
  for (int i = 0; i < 9; ++i) imu.doubles(0);
  imu.doubles(0.1, 0.2, 0.3);
  for (int i = 0; i < 9; ++i) imu.doubles(0);
  imu.doubles(0, 0, 9.81);
  for (int i = 0; i < 9; ++i) imu.doubles(0);
  const logs::RawLog log = messages_of("sensor_msgs/msg/Imu", "", {imu.message()});
  EXPECT_EQ(values_in(log, "/t", "linear_acceleration.z"), std::vector<double>{9.81});
  EXPECT_EQ(values_in(log, "/t", "angular_velocity.y"), std::vector<double>{0.2});
}

TEST(RosTopic, TakesTheVersionOfAMessageWhoseSizeItHas) {
  for (const bool is_double : {false, true}) {
    CdrWriter writer;
    writer.header(1, 0, "").number(std::uint32_t{77}).count(3);
    for (int i = 0; i < 3; ++i)
      is_double ? writer.number(1.0 * i) : writer.number(1.0f * static_cast<float>(i));
    const logs::RawLog log = messages_of("crazyflie_interfaces/msg/LogDataGeneric", "", {writer.message()});
    EXPECT_EQ(values_in(log, "/t", "values[2]"), std::vector<double>{2}) << is_double;
    EXPECT_TRUE(log.left_out.empty());
  }
}

TEST(RosTopic, ReadsTheFieldsThatAllVersionsOfAPx4MessageShare) {
  CdrWriter battery;
  battery.number(std::uint64_t{1'000'000})
      .number(std::uint8_t{1})
      .number(15.5f)
      .number(3.0f)
      .number(std::uint8_t{4});
  const logs::RawLog log = messages_of("px4_msgs/msg/BatteryStatus", "", {battery.message()});
  EXPECT_EQ(values_in(log, "/t", "voltage_v"), std::vector<double>{15.5});
}

TEST(RosTopic, MessagesOfAnotherSizeThanTheirDefinitionAreCountedNotRead) {
  const std::string sound = CdrWriter().doubles(1, 2).message();
  const std::vector<std::string> odd = {"", "abc", sound.substr(0, 12), sound + "12345678",
                                        std::string("\0\x09\0\0", 4) + sound};
  std::vector<std::string> messages = {sound};
  messages.insert(messages.end(), odd.begin(), odd.end());
  messages.push_back(sound + std::string(3, '\0'));  // padding to a multiple of four is usual
  const logs::RawLog log = messages_of("p/T", "float64 x\nfloat64 y\n", messages);
  EXPECT_EQ(values_in(log, "/t", "y"), (std::vector<double>{2, 2}));
  EXPECT_EQ(log.health.damaged_blocks, odd.size());
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_EQ(log.left_out[0].records, odd.size());
}

TEST(RosTopic, CountsOfArraysAreNotBelieved) {
  for (const std::uint32_t count : {0xFFFFFFFFu, 1000u, 300u}) {
    for (const char* const definition : {"float64[] x\n", "string[] x\n", "Empty[] x\n===\nMSG: p/Empty\n"}) {
      const logs::RawLog log =
          messages_of("p/T", definition, {CdrWriter().count(count).doubles(1, 2, 3).message()});
      EXPECT_TRUE(log.topics.empty()) << definition;
      EXPECT_EQ(log.health.damaged_blocks, 1u) << definition;
    }
  }
}

TEST(RosTopic, LargeArraysAreNamedAndTheRestOfTheMessageIsRead) {
  CdrWriter writer;
  writer.count(1000);
  for (int i = 0; i < 1000; ++i) writer.number(std::uint8_t{1});
  writer.number(2.5);
  const logs::RawLog log = messages_of("p/Image", "uint8[] data\nfloat64 x\n", {writer.message()});
  EXPECT_EQ(column_names(topic_of(log, "/t")), std::vector<std::string>{"x"});
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_EQ(log.left_out[0].name, "/t.data");
}

TEST(RosTopic, OneLongMessageAmongManyShortOnesIsGivenUp) {
  // 256 columns for each of 3000 messages of 8 bytes: 6 MB from 24 kB.
  CdrWriter large;
  large.count(256);
  for (int i = 0; i < 256; ++i) large.number(std::uint8_t{1});
  std::vector<std::string> messages(3000, CdrWriter().count(0).message());
  messages[0] = large.message();
  const logs::RawLog log = messages_of("p/T", "uint8[] data\n", messages);
  EXPECT_TRUE(log.topics.empty());
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_EQ(log.left_out[0].records, 3000u);
}

TEST(RosTopic, EveryBuiltinDefinitionCanBeUsed) {
  for (const char* const type :
       {"std_msgs/Float32", "std_msgs/Float64", "geometry_msgs/Accel", "geometry_msgs/AccelStamped",
        "geometry_msgs/WrenchStamped", "geometry_msgs/PointStamped", "geometry_msgs/Vector3Stamped",
        "geometry_msgs/QuaternionStamped", "geometry_msgs/PoseWithCovarianceStamped",
        "sensor_msgs/BatteryState", "crazyflie_interfaces/FullState"}) {
    ASSERT_FALSE(logs::builtin_ros_definitions(type).empty()) << type;
    std::string fault;
    EXPECT_NE(logs::ros_layout(type, "", fault), nullptr) << type << ": " << fault;
  }
}

}  // namespace
}  // namespace swarmcert::tests

/// Column names: the table of signals, the list of formats, and crazyflies.yaml beside a bag of Crazyswarm2.
#include "analysis/logs/variable_names.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "analysis/logs/column_names.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/message_frames.h"
#include "analysis/logs/read_log.h"
#include "analysis/logs/recognition.h"
#include "data.h"
#include "logs/rosbag_writer.h"
#include "nn/base/input_error.h"
#include "nn/temp_folder.h"

namespace swarmcert::tests {
namespace {

TEST(ColumnNames, EveryRowOfTheTableIsASignalByItself) {
  // A signal name is one line of the table and is not needed elsewhere.
  std::size_t rows = 0;
  for (const logs::NamedColumns& row : logs::column_names()) {
    if (row.signal == logs::kTime) continue;  // the clock of a table, or a receiver's
    logs::RawLog log;
    log.topics.emplace_back();
    logs::RawTopic& topic = log.topics.back();
    topic.time_s = {0, 0.01, 0.02};
    std::vector<std::string> notes;
    if (row.origin == logs::Origin::kMessages) topic.type = "sensor_msgs/msg/Imu";
    for (const std::string& name : row.names) topic.columns.push_back({name, {0.5, 0.5, 0.5}});
    if (row.origin == logs::Origin::kFirmware) {
      log.format = row.program == "px4" ? "ulog" : row.program;
      topic.name = row.message;
      if (row.unit == "us")
        for (logs::RawColumn& column : topic.columns) column.values = {1000, 1500, 2000};
      logs::add_own_names(log, notes);
    }
    const logs::Recognition found = logs::recognise(log, {});
    const logs::Carried* const carried = found.find(row.signal);
    ASSERT_NE(carried, nullptr) << row.names[0];
    for (std::size_t k = 0; k < carried->size(); ++k) EXPECT_GE(carried->columns[k], 0) << row.names[0];
    ++rows;
  }
  EXPECT_GT(rows, 70u);
}

TEST(ColumnNames, AUnitMayStandInBracketsOrBehindTheName) {
  const auto unit = [](const std::string& column) { return logs::stated_unit(column).unit; };
  const auto plain = [](const std::string& column) { return logs::stated_unit(column).plain; };
  EXPECT_EQ(unit("vx (mm/s)"), "mm/s");
  EXPECT_EQ(unit("Acc Z [m/s^2]"), "m/s^2");
  EXPECT_EQ(unit("Motor 1 (%)"), "%");
  EXPECT_EQ(unit("vx_mm_s"), "mm/s");  // not m/s of a signal "vx.m"
  EXPECT_EQ(plain("vx_mm_s"), "vx");
  EXPECT_EQ(unit("acc_z_mps2"), "m/s^2");
  EXPECT_EQ(plain("roll_deg"), "roll");
  EXPECT_EQ(unit("vbat_mV"), "mV");
  EXPECT_GT(logs::read_name("battery_mV").bits[logs::kIsBattery], 0) << "mV is no capital within a name";
  // A name alone is not a unit, and unknown units are ignored.
  for (const char* const column : {"m", "g", "x", "q.w", "pos_x_furlong", "time[ms]"})
    EXPECT_EQ(unit(column), "") << column;
}

TEST(ColumnNames, AUnitBehindTheNameCountsOnlyForSignalsOfThatUnit) {
  const auto recognised = [](const std::vector<std::string>& names) {
    logs::RawLog log;
    log.topics.emplace_back();
    log.topics.back().time_s = {0, 0.01, 0.02};
    for (const std::string& name : names) log.topics.back().columns.push_back({name, {0.5, 0.5, 0.5}});
    return logs::recognise(log, {});
  };
  const logs::Recognition speeds = recognised({"x_mm_s", "y_mm_s", "z_mm_s"});
  EXPECT_EQ(speeds.find(logs::kPosition), nullptr);
  const logs::Recognition places = recognised({"x_cm", "y_cm", "z_cm"});
  ASSERT_NE(places.find(logs::kPosition), nullptr);
  EXPECT_EQ(places.find(logs::kPosition)->factor.divide, 100);
  // The firmware's own names keep their units, whatever their last word.
  const logs::Recognition duties = recognised({"pwm.m1_pwm", "pwm.m2_pwm", "pwm.m3_pwm", "pwm.m4_pwm"});
  ASSERT_NE(duties.find(logs::kDuty), nullptr);
  EXPECT_EQ(duties.find(logs::kDuty)->unit, "1/65536");
  // One factor for all: columns in different units are refused, not scaled by the unit of the first.
  for (const std::vector<std::string>& mixed :
       {std::vector<std::string>{"x_m", "y_m", "z_mm"}, {"x", "y", "z_mm"}}) {
    const logs::Recognition refused = recognised(mixed);
    EXPECT_EQ(refused.find(logs::kPosition), nullptr) << mixed[1];
    ASSERT_FALSE(refused.rejected.empty());
    EXPECT_EQ(refused.rejected[0], mixed[0] + ", " + mixed[1] + ", z_mm: different units");
  }
  // A column that has the name without a unit takes precedence.
  const logs::Recognition both = recognised({"x_mm", "y_mm", "z_mm", "x", "y", "z"});
  ASSERT_NE(both.find(logs::kPosition), nullptr);
  EXPECT_EQ(both.find(logs::kPosition)->columns, (std::vector<int>{3, 4, 5}));
}

TEST(Formats, EachIsOneLineOfTheListAndOneSource) {
  const std::filesystem::path folder = source_path("analysis/logs/formats");
  std::ifstream in(folder / "formats.h");
  std::ostringstream text;
  text << in.rdbuf();
  const std::string list = text.str();
  const std::regex line("FORMAT\\(\"([^\"]+)\", (\\w+)\\)");
  std::size_t formats = 0;
  for (std::sregex_iterator at(list.begin(), list.end(), line), end; at != end; ++at, ++formats) {
    EXPECT_TRUE(std::filesystem::exists(folder / ((*at)[2].str() + ".cpp"))) << (*at)[2];
    ASSERT_LT(formats, logs::log_formats().size());
    EXPECT_EQ(logs::log_formats()[formats].name, (*at)[1].str());
  }
  EXPECT_EQ(formats, logs::log_formats().size());
}

constexpr const char* kYaml = R"(# of Crazyswarm2
fileversion: 3
robots:
  cf1:
    enabled: true
    type: heavy  # see robot_types
    firmware_logging:
      custom_topics:
        motion: {frequency: 100}
  cf2:
    type: light
    firmware_logging:
      custom_topics:
        motion:
          frequency: 100
          vars: ["stateEstimate.x", 'stateEstimate.y']
robot_types:
  heavy:
    motion_capture:
      tracking: "librigidbodytracker"
    firmware_logging:
      custom_topics:
        battery:
          vars:
            - pm.vbat
            - pm.vbatMV
all:
  firmware_logging:
    enabled: true
    default_topics:
      pose:
        frequency: 10
    custom_topics:
      motion:
        frequency: 100 # Hz
        vars: ["stateEstimate.x", "stateEstimate.y", "stateEstimate.z",
               "stateEstimate.vx", "stateEstimate.vy", "stateEstimate.vz"]  # six
)";

TEST(CrazyfliesYaml, ARobotGoesBeforeItsTypeAndItsTypeBeforeAll) {
  const logs::CustomTopics topics = logs::parse_custom_topics(kYaml);
  EXPECT_EQ(topics.variables("/cf2/motion"),
            (std::vector<std::string>{"stateEstimate.x", "stateEstimate.y"}));
  EXPECT_EQ(topics.variables("/cf1/motion").size(), 6u);
  EXPECT_EQ(topics.variables("/cf1/motion")[5], "stateEstimate.vz");
  EXPECT_EQ(topics.variables("/cf1/battery"), (std::vector<std::string>{"pm.vbat", "pm.vbatMV"}));
  EXPECT_TRUE(topics.variables("/cf2/battery").empty());
  EXPECT_TRUE(topics.variables("battery").empty());
}

TEST(CrazyfliesYaml, LinesOfAnyOtherFileAreHarmless) {
  for (const char* const text : {"vars: [a, b", "- a\n- b", "custom_topics:\n  t:\n    vars: [", ":",
                                 "]\n:\n\"", "robots:\n custom_topics:\n  x:\n   vars:\n   - \"\n"})
    logs::parse_custom_topics(text);
}

/// Returns a bag with one LogDataGeneric topic of six values, from a vehicle that climbs at 0.5 m/s.
std::string generic_bag(const std::string& topic) {
  std::string statements =
      rosbag_tables() + rosbag_topic(1, topic, "crazyflie_interfaces/msg/LogDataGeneric");
  for (int k = 0; k < 300; ++k) {
    const double t = 0.01 * k;
    CdrWriter message;
    message.header(1, 0, "world").number(static_cast<std::uint32_t>(10 * k)).count(6);
    for (const double value : {0.1, 0.2, 0.3 + 0.5 * t, 0.0, 0.0, 0.5})
      message.number(static_cast<float>(value));
    statements += rosbag_message(1, 1'000'000'000 + 10'000'000L * k, message.message());
  }
  return sqlite_bytes(statements);
}

class BagBesideYaml : public testing::Test {
 protected:
  logs::Log read(const std::string& topic, const std::string& yaml) {
    std::ofstream(folder_ / "flight.db3", std::ios::binary) << generic_bag(topic);
    std::ofstream(folder_ / "crazyflies.yaml") << yaml;
    return logs::read_log(folder_ / "flight.db3");
  }

  const TempFolder folder_;
};

TEST_F(BagBesideYaml, ValuesAreSignalsWithoutAColumnsToml) {
  const logs::Log log = read("/cf1/motion", kYaml);
  EXPECT_TRUE(log.signals.position);
  ASSERT_EQ(log.samples.size(), 300u);
  EXPECT_NEAR(log.samples[200].position_m[2], 1.3, 1e-6);
  EXPECT_NEAR(log.samples[200].velocity_m_s[2], 0.5, 1e-6);
  EXPECT_EQ(log.interpretation.at(0), "the values of /cf1/motion are named by crazyflies.yaml");
}

TEST_F(BagBesideYaml, NamesOfAnotherNumberOfValuesAreNotTaken) {
  try {
    read("/cf2/motion", kYaml);
    FAIL() << "two names cannot stand for six values";
  } catch (const files::InputError& error) {
    EXPECT_NE(error.fault().hint.find("crazyflies.yaml names 2 variables of /cf2/motion, which has 6 values"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace swarmcert::tests

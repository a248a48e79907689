#include "analysis/logs/formats/crazyflie_csv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "logs/raw_log_invariant.h"
#include "logs/topics.h"
#include "nn/refusal.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

logs::RawLog csv_of(const std::string& text) {
  std::istringstream in(text);
  const logs::RawLog log = logs::parse_raw(in, "log.csv");
  EXPECT_EQ(broken_rule(log), "");
  return log;
}

/// A file as written by cfclient: integers, and floats as Python prints them.
std::string cfclient_csv(int first, int last) {
  std::string text = "Timestamp,stabilizer.roll,pm.vbat,motor.m1\n";
  for (int k = first; k < last; ++k)
    text += std::to_string(5000 + 10 * k) + "," + std::to_string(k) + ".5,3.7e0,1" + std::to_string(k) + "\n";
  return text;
}

TEST(CrazyflieCsv, ReadsWhatCfclientWrites) {
  const logs::RawLog log = csv_of(cfclient_csv(0, 4));
  EXPECT_EQ(log.format, "csv");
  const logs::RawTopic& topic = topic_of(log, "csv");
  EXPECT_EQ(topic.time_s, (std::vector<double>{5.0, 5.01, 5.02, 5.03}));
  EXPECT_EQ(values_of(topic, "stabilizer.roll"), (std::vector<double>{0.5, 1.5, 2.5, 3.5}));
  EXPECT_EQ(values_of(topic, "motor.m1")[2], 12);
  EXPECT_EQ(values_of(topic, "Timestamp")[0], 5000) << "the column of the time stays as it is";
  EXPECT_EQ(log.texts.at("time_unit"), "ms");
  EXPECT_EQ(log.health.records, 4u);
}

TEST(CrazyflieCsv, TakesUnitsFromTheHead) {
  const logs::RawLog log = csv_of("time[s];acc.z[g];pm.vbat (V);a.b[0]\n1;0.5;3.7;4\n");
  const logs::RawTopic& topic = topic_of(log, "csv");
  EXPECT_EQ(topic.time_s, std::vector<double>{1});
  EXPECT_EQ(topic.find("acc.z[g]")->unit, "g");
  EXPECT_EQ(topic.find("pm.vbat (V)")->unit, "V");
  EXPECT_EQ(topic.find("a.b[0]")->unit, "") << "an index is no unit";
}

TEST(CrazyflieCsv, FindsTheUnitOfTheTimeInItsSteps) {
  for (const auto& [step, unit] : {std::pair{"0.01", "s"}, std::pair{"2", "ms"}, std::pair{"100", "ms"},
                                   std::pair{"2000", "us"}, std::pair{"1e7", "ns"}}) {
    std::string text = "timestamp,gyro.x\n";
    for (int k = 0; k < 10; ++k) text += std::to_string(k * std::stod(step)) + ",1\n";
    EXPECT_EQ(csv_of(text).texts.at("time_unit"), unit) << step;
  }
}

TEST(CrazyflieCsv, TextInACellIsNotANumberAndCostsNoOtherCell) {
  const logs::RawLog log =
      csv_of("tick,sys.state,block,acc.z\n10,flying,Pose,1\n20,3,Pose,\n30,nan,Pose,inf\n");
  const logs::RawTopic& topic = topic_of(log, "csv");
  EXPECT_EQ(topic.time_s.size(), 3u);
  EXPECT_TRUE(std::isnan(values_of(topic, "sys.state")[0]));
  EXPECT_EQ(values_of(topic, "sys.state")[1], 3);
  EXPECT_TRUE(std::isnan(values_of(topic, "acc.z")[1]));
  EXPECT_TRUE(std::isinf(values_of(topic, "acc.z")[2]));
  EXPECT_EQ(topic.find("block"), nullptr);
  ASSERT_EQ(log.skipped.size(), 1u);
  EXPECT_EQ(log.skipped[0].name, "block");
  EXPECT_EQ(log.health.damaged_lines, 0u);
}

TEST(CrazyflieCsv, DamagedLinesAreCountedAndLeftOut) {
  const logs::RawLog log = csv_of("Timestamp,acc.z\n10,1\n20\n30,1,2\nx,1\n,1\n40,1\n5");
  EXPECT_EQ(topic_of(log, "csv").time_s, (std::vector<double>{0.01, 0.04}));
  EXPECT_EQ(log.health.damaged_lines, 3u);
  EXPECT_EQ(log.health.not_finite, 1u);
  EXPECT_TRUE(log.health.truncated);
}

TEST(CrazyflieCsv, OtherTablesAreNoneOfThese) {
  EXPECT_TRUE(logs::looks_like_crazyflie_csv("\xEF\xBB\xBF# Time,\"gyro.x\"\r\n1,2\r\n"));
  for (const char* const head : {"", "Timestamp", "Timestamp,roll\n1,2\n", "roll,gyro.x\n",
                                 "# time[ms],x[m],y[m]\n", "Timestamp 1.5,2.5\n", "time,1.5\n", "t,a.b.c\n"})
    EXPECT_FALSE(logs::looks_like_crazyflie_csv(head)) << head;
  EXPECT_TRUE(refuses([] { csv_of("Timestamp,a.b,a.b\n1,2,3\n"); }, {"log.csv", "names a column twice"}));
}

TEST(CrazyflieCsv, EveryDamagedByteGivesALogOrARefusal) {
  const std::string sound = cfclient_csv(0, 20);
  int kept = 0;
  for (std::size_t i = 0; i < sound.size(); ++i) {
    for (const int flip : {0x01, 0x80}) {
      std::string text = sound;
      text[i] = static_cast<char>(text[i] ^ flip);
      std::istringstream in(text);
      try {
        const logs::RawLog log = logs::read_crazyflie_csv(in, "log.csv");
        EXPECT_EQ(broken_rule(log), "") << i;
        kept += log.health.records >= 18 ? 1 : 0;
      } catch (const files::InputError&) {
        EXPECT_LT(i, sound.find('\n') + 1);
      }
    }
  }
  EXPECT_GT(kept, 600);
}

TEST(CrazyflieCsv, ASessionOfCfclientIsOneLogWithATopicForEachBlock) {
  const fs::path folder = fs::path(testing::TempDir()) / "20260131T12-00-00";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
  };
  write("pose-20260131T12-00-05.csv", cfclient_csv(0, 3));
  write("pose-20260131T12-01-05.csv", cfclient_csv(100, 102));
  write("power-20260131T12-00-06.csv", "Timestamp,pm.vbat\n5001,3.7\n5101,3.6\n");
  const logs::RawLog log = logs::read_raw(folder.string());
  EXPECT_EQ(broken_rule(log), "");
  ASSERT_EQ(log.topics.size(), 2u);
  EXPECT_EQ(topic_of(log, "pose").time_s, (std::vector<double>{5.0, 5.01, 5.02, 6.0, 6.01}));
  EXPECT_EQ(values_in(log, "power", "pm.vbat"), (std::vector<double>{3.7, 3.6}));
  EXPECT_EQ(log.health.records, 7u);
  write("notes.csv", "any,table\n1,2\n");
  EXPECT_FALSE(logs::looks_like_cfclient_folder(folder.string()))
      << "a folder with other tables is not one log";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace swarmcert::tests

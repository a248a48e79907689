#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "analysis/logs/csv.h"
#include "analysis/logs/formats/formats.h"
#include "logs/raw_log_invariant.h"
#include "logs/topics.h"
#include "nn/refusal.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

logs::RawLog csv_of(const std::string& text) {
  std::istringstream in(text);
  const logs::RawLog log = logs::read_table(in, "log.csv", {});
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

std::vector<long> milliseconds(const logs::RawTopic& topic) {
  std::vector<long> times;
  for (const double time_s : topic.time_s) times.push_back(std::lround(1e3 * time_s));
  return times;
}

TEST(CrazyflieCsv, ReadsWhatCfclientWrites) {
  const logs::RawLog log = csv_of(cfclient_csv(0, 4));
  EXPECT_EQ(log.format, "csv");
  const logs::RawTopic& topic = log.topics.at(0);
  EXPECT_EQ(milliseconds(topic), (std::vector<long>{5000, 5010, 5020, 5030}));
  EXPECT_EQ(values_of(topic, "stabilizer.roll"), (std::vector<double>{0.5, 1.5, 2.5, 3.5}));
  EXPECT_EQ(values_of(topic, "motor.m1")[2], 12);
  EXPECT_EQ(values_of(topic, "Timestamp")[0], 5000) << "the column of the time stays as it is";
  EXPECT_EQ(topic.clock, "Timestamp");
  EXPECT_EQ(log.health.records, 4u);
}

TEST(CrazyflieCsv, FindsTheUnitOfTheTimeInItsSteps) {
  for (const auto& [step, unit_s] :
       {std::pair{"0.01", 1.0}, {"2", 1e-3}, {"100", 1e-3}, {"2000", 1e-6}, {"1e7", 1e-9}}) {
    std::string text = "timestamp,gyro.x\n";
    for (int k = 0; k < 10; ++k) text += std::to_string(k * std::stod(step)) + ",1\n";
    EXPECT_EQ(csv_of(text).topics[0].clock_unit_s, unit_s) << step;
  }
}

TEST(CrazyflieCsv, TextInACellIsNotANumberAndCostsNoOtherCell) {
  const logs::RawLog log =
      csv_of("tick,sys.state,block,acc.z\n10,flying,Pose,1\n20,3,Pose,\n30,nan,Pose,inf\n");
  const logs::RawTopic& topic = log.topics.at(0);
  EXPECT_EQ(topic.time_s.size(), 3u);
  EXPECT_TRUE(std::isnan(values_of(topic, "sys.state")[0]));
  EXPECT_EQ(values_of(topic, "sys.state")[1], 3);
  EXPECT_TRUE(std::isnan(values_of(topic, "acc.z")[1]));
  EXPECT_TRUE(std::isinf(values_of(topic, "acc.z")[2]));
  EXPECT_EQ(log.health.damaged_lines, 0u);
}

TEST(CrazyflieCsv, DamagedLinesAreCountedAndLeftOut) {
  const logs::RawLog log = csv_of("Timestamp,acc.z\n10,1\n20\n30,1,2\nx,1\n40,1\n5");
  EXPECT_EQ(values_of(log.topics.at(0), "Timestamp"), (std::vector<double>{10, 40}));
  EXPECT_EQ(log.health.damaged_lines, 3u);
  EXPECT_TRUE(log.health.truncated);
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
        const logs::RawLog log = logs::read_table(in, "log.csv", {});
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
  EXPECT_EQ(milliseconds(topic_of(log, "pose")), (std::vector<long>{5000, 5010, 5020, 6000, 6010}));
  EXPECT_EQ(values_in(log, "power", "pm.vbat"), (std::vector<double>{3.7, 3.6}));
  EXPECT_EQ(log.health.records, 7u);
  write("notes.csv", "any,table\n1,2\n");
  EXPECT_FALSE(logs::looks_like_cfclient_folder(folder.string()))
      << "a folder with other tables is not one log";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace swarmcert::tests

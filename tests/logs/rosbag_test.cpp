#include <gtest/gtest.h>
#include <zstd.h>

#include <filesystem>
#include <fstream>

#include "analysis/logs/formats/formats.h"
#include "analysis/logs/read_log.h"
#include "logs/mcap_writer.h"
#include "logs/raw_log_invariant.h"
#include "logs/rosbag_writer.h"
#include "logs/topics.h"
#include "nn/base/file_io.h"
#include "nn/refusal.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

logs::RawLog rosbag_of(std::string bytes, const std::string& path = "bag.db3") {
  return logs::read_rosbag_sqlite(bytes, path);
}

/// Returns x of the poses that were read: their numbers.
std::vector<double> poses_in_rosbag(const logs::RawLog& log) {
  return values_in(log, "/cf1/pose", "pose.position.x");
}

std::string zstd_of(const std::string& bytes) {
  std::string compressed(ZSTD_compressBound(bytes.size()), '\0');
  compressed.resize(ZSTD_compress(compressed.data(), compressed.size(), bytes.data(), bytes.size(), 3));
  return compressed;
}

/// A separate folder for each test, removed afterwards.
class RosbagFolder : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              (std::string("rosbag_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  void write_metadata(const std::vector<std::string>& files) {
    std::string text = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n";
    for (const std::string& file : files) text += "    - " + file + "\n";
    write("metadata.yaml", text + "  duration:\n    nanoseconds: 1\n");
  }
  fs::path folder_;
};

TEST(RosbagSqlite, GivesMessagesWithBuiltInDefinitions) {
  const logs::RawLog log = rosbag_of(small_rosbag());
  EXPECT_EQ(log.format, "rosbag2 sqlite");
  EXPECT_EQ(poses_in_rosbag(log), range(0, 20));
  EXPECT_EQ(topic_of(log, "/cf1/pose").time_s[3], 1.03);
  EXPECT_EQ(log.health.records, 20u);
  EXPECT_EQ(log.health.damaged_blocks, 0u);
  EXPECT_FALSE(log.health.truncated);
}

TEST(RosbagSqlite, PrefersTheDefinitionsOfTheFile) {
  const std::string definitions =
      "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT "
      "NULL,encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);INSERT INTO "
      "message_definitions VALUES(1,'own_msgs/msg/Two','ros2msg','float64 first\nfloat64 second\n','');";
  const logs::RawLog log =
      rosbag_of(sqlite_bytes(rosbag_tables() + definitions + rosbag_topic(1, "/two", "own_msgs/msg/Two") +
                             rosbag_message(1, 5, CdrWriter().doubles(1, 2).message())));
  EXPECT_EQ(values_in(log, "/two", "second"), std::vector<double>{2});
}

TEST(RosbagSqlite, NamesTopicsThatItCannotRead) {
  const logs::RawLog log =
      rosbag_of(sqlite_bytes(rosbag_tables() + rosbag_topic(1, "/cf1/pose", "geometry_msgs/msg/PoseStamped") +
                             rosbag_topic(2, "/odd", "odd/msg/Odd") +
                             rosbag_topic(3, "/json", "geometry_msgs/msg/PoseStamped", "json") +
                             rosbag_message(2, 1, "x") + rosbag_message(2, 2, "x") +
                             rosbag_message(3, 1, "{}") + rosbag_message(9, 1, "x") + rosbag_poses(0, 2)));
  EXPECT_EQ(poses_in_rosbag(log), range(0, 2));
  ASSERT_EQ(log.left_out.size(), 3u);
  EXPECT_EQ(log.left_out[0].name, "/odd");
  EXPECT_NE(log.left_out[0].why.find("odd/msg/Odd"), std::string::npos);
  EXPECT_EQ(log.left_out[0].records, 2u);
  EXPECT_EQ(log.left_out[1].name, "/json");
  EXPECT_EQ(log.left_out[2].name, "messages without topic");
}

TEST(RosbagSqlite, ReadsMessagesThatWereCompressedOneByOne) {
  const logs::RawLog log = rosbag_of(sqlite_bytes(
      rosbag_tables() + rosbag_topic(1, "/cf1/pose", "geometry_msgs/msg/PoseStamped") +
      rosbag_message(1, 1, zstd_of(cdr_pose(7, 0, 0))) + rosbag_message(1, 2, zstd_of("x").substr(0, 9))));
  EXPECT_EQ(poses_in_rosbag(log), std::vector<double>{7});
  EXPECT_EQ(log.health.damaged_blocks, 1u);
}

TEST(RosbagSqlite, ReadsADatabaseThatWasWrittenWithAWriteAheadLog) {
  std::string bytes = small_rosbag();
  bytes[18] = bytes[19] = 2;  // as in the header of such a database
  EXPECT_EQ(poses_in_rosbag(rosbag_of(bytes)), range(0, 20));
}

/// A recorder that is killed leaves its last transactions in the journal of the database.
TEST_F(RosbagFolder, WhatAKilledRecorderLeftInTheJournalIsRead) {
  write("live.db3", small_rosbag());
  sqlite3* recorder = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / "live.db3").c_str(), &recorder), SQLITE_OK);
  const auto run = [&](const std::string& statements) {
    EXPECT_EQ(sqlite3_exec(recorder, statements.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  };
  run("PRAGMA journal_mode=WAL;PRAGMA wal_autocheckpoint=0;");
  for (int k = 20; k < 60; k += 10) run("BEGIN;" + rosbag_poses(k, k + 10) + "COMMIT;");
  const std::string journal = files::read_file((folder_ / "live.db3-wal").string());
  write("bag.db3", files::read_file((folder_ / "live.db3").string()));
  sqlite3_close(recorder);
  const auto read_with = [&](const std::string& bytes) {
    write("bag.db3-wal", bytes);
    return logs::read_raw((folder_ / "bag.db3").string());
  };
  const logs::RawLog whole = read_with(journal);
  EXPECT_EQ(poses_in_rosbag(whole), range(0, 60));
  EXPECT_GT(whole.health.repaired.journal_pages, 0u);
  EXPECT_TRUE(logs::completeness_of(whole.health) == logs::Completeness::kComplete);
  EXPECT_TRUE(whole.left_out.empty());
  // Cut or damaged anywhere: the transactions before are read, as SQLite reads them.
  for (std::size_t size = 0; size < journal.size(); size += 97) {
    std::string damaged = journal;
    damaged[size] = static_cast<char>(damaged[size] ^ 0x40);
    for (const std::string& bytes : {journal.substr(0, size), damaged}) {
      const std::vector<double> poses = poses_in_rosbag(read_with(bytes));
      EXPECT_EQ(poses.size() % 10, 0u) << size;
      EXPECT_GE(poses.size(), 20u) << size;
      EXPECT_EQ(poses, range(0, static_cast<int>(poses.size()))) << size;
    }
  }
}

TEST_F(RosbagFolder, AJournalOfAnotherFormIsNamed) {
  write("bag.db3-wal", "what the recorder wrote last");
  write("bag.db3", small_rosbag());
  const logs::RawLog log = logs::read_raw((folder_ / "bag.db3").string());
  EXPECT_EQ(poses_in_rosbag(log), range(0, 20));
  EXPECT_TRUE(log.health.truncated);
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_NE(log.left_out[0].name.find("bag.db3-wal"), std::string::npos);
  int files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_)) ++files;
  EXPECT_EQ(files, 2) << "reading creates nothing";
}

TEST(RosbagSqlite, EndingAnywhereKeepsTheMessagesBeforeOrIsRefused) {
  const std::string bytes = small_rosbag();
  std::size_t most = 0;
  for (std::size_t size = 1; size < bytes.size(); size += 64) {
    try {
      const logs::RawLog log = rosbag_of(bytes.substr(0, size));
      const std::vector<double> found = poses_in_rosbag(log);
      EXPECT_EQ(found, range(0, static_cast<int>(found.size()))) << size;
      EXPECT_TRUE(log.health.truncated || log.health.damaged_blocks > 0 || found.size() == 20) << size;
      most = std::max(most, found.size());
    } catch (const files::InputError&) {
    }
  }
  EXPECT_GT(most, 3u);
}

TEST(RosbagSqlite, RefusesSchemasThatCouldDoAnything) {
  const std::string topic = rosbag_topic(1, "/cf1/pose", "geometry_msgs/msg/PoseStamped");
  const std::string tables = rosbag_tables();
  const std::string drop = "DROP TABLE messages;";
  // An endless view.
  EXPECT_TRUE(refuses(
      [&] {
        rosbag_of(sqlite_bytes(
            tables + topic + drop +
            "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n) "
            "SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n;"));
      },
      {"\"messages\"", "is missing or cannot be read"}));
  // Computed columns that produce a large value for each row.
  EXPECT_TRUE(refuses(
      [&] {
        rosbag_of(
            sqlite_bytes(tables + topic + drop +
                         "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data AS "
                         "(zeroblob(60000000)));INSERT INTO messages(topic_id,timestamp) VALUES(1,1);"));
      },
      {"\"messages\"", "is missing or cannot be read"}));
  // A virtual table.
  EXPECT_TRUE(refuses(
      [&] {
        rosbag_of(sqlite_bytes(tables + topic + drop +
                               "CREATE VIRTUAL TABLE messages USING fts5(topic_id, timestamp, data);"));
      },
      {"\"messages\"", "is missing or cannot be read"}));
}

TEST(RosbagSqlite, RefusesWhatItCannotRead) {
  EXPECT_TRUE(refuses([] { rosbag_of("SQLite format 2"); }, {"offset 0", "magic number"}));
  EXPECT_TRUE(refuses([] { rosbag_of(sqlite_bytes("CREATE TABLE other(x);")); },
                      {"\"topics\"", "is missing", "not a rosbag2 log"}));
  EXPECT_TRUE(refuses([] { rosbag_of(sqlite_bytes("CREATE TABLE topics(x); CREATE TABLE messages(x);")); },
                      {"\"topics\"", "does not have the columns"}));
}

TEST(RosbagSqlite, EveryDamagedByteGivesALogOrARefusal) {
  const std::string sound = small_rosbag();
  int refused = 0, read_all = 0;
  for (std::size_t i = 0; i < sound.size(); i += 1) {
    std::string bytes = sound;
    bytes[i] = static_cast<char>(bytes[i] ^ (i % 2 == 0 ? 0xFF : 0x01));
    try {
      const logs::RawLog log = rosbag_of(bytes);
      EXPECT_EQ(broken_rule(log), "") << "byte " << i;
      read_all += log.health.records == 20 ? 1 : 0;
    } catch (const files::InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 16);
  EXPECT_GT(read_all, 1000);
}

TEST_F(RosbagFolder, FilesOfAFolderAreOneLogInTheOrderOfItsMetadata) {
  const auto part = [](int first, int last) {
    const std::string data = mcap_magic() + mcap_header() + mcap_pose_definitions() + mcap_poses(first, last);
    return data + mcap_end(data);
  };
  write("bag_0.mcap", part(0, 4));
  write("bag_1.mcap.zstd", zstd_of(part(4, 9)));
  write("bag_2.mcap", part(9, 12));
  write_metadata({"bag_0.mcap", "some/folder/bag_1.mcap.zstd", "\"bag_2.mcap\""});
  const logs::RawLog log = logs::read_raw(folder_.string());
  EXPECT_EQ(poses_in_rosbag(log), range(0, 12));
  EXPECT_EQ(log.health.records, 12u);
  EXPECT_EQ(log.path, folder_.string());
  EXPECT_FALSE(log.health.truncated);
  EXPECT_EQ(broken_rule(log), "");
}

TEST_F(RosbagFolder, APartThatIsMissingIsNamed) {
  write("bag_0.db3", small_rosbag());
  write_metadata({"bag_0.db3", "bag_1.db3", "../../../etc/passwd"});
  const logs::RawLog log = logs::read_raw(folder_.string());
  EXPECT_EQ(poses_in_rosbag(log), range(0, 20));
  EXPECT_TRUE(log.health.truncated);
  ASSERT_EQ(log.left_out.size(), 2u);
  EXPECT_EQ(log.left_out[0].name, "bag_1.db3");
  EXPECT_EQ(log.left_out[1].name, "passwd") << "looked for in the folder only";
}

TEST_F(RosbagFolder, RefusesAFolderWithoutAFileThatCanBeRead) {
  EXPECT_FALSE(logs::looks_like_rosbag_folder(folder_.string()));
  write_metadata({"bag_0.db3"});
  EXPECT_TRUE(logs::looks_like_rosbag_folder(folder_.string()));
  EXPECT_TRUE(refuses([&] { logs::read_raw(folder_.string()); },
                      {"metadata.yaml", "none of the bag's files", "copy"}));
}

}  // namespace
}  // namespace swarmcert::tests

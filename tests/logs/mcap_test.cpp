#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "data.h"
#include "logs/mcap_writer.h"
#include "logs/raw_log_invariant.h"
#include "logs/topics.h"
#include "nn/refusal.h"

namespace swarmcert::tests {
namespace {

logs::RawLog mcap_of(std::string bytes) { return logs::read_mcap(bytes, "bag.mcap"); }

/// Returns x of the poses that were read: their numbers.
std::vector<double> poses_in_mcap(const logs::RawLog& log) {
  return values_in(log, "/cf1/pose", "pose.position.x");
}

std::string pose_file(const std::string& data) {
  const std::string bytes = mcap_magic() + mcap_header() + mcap_pose_definitions() + data;
  return bytes + mcap_end(bytes);
}

TEST(Mcap, GivesMessagesInAndOutsideChunks) {
  const logs::RawLog log = mcap_of(small_mcap());
  EXPECT_EQ(log.format, "mcap");
  EXPECT_EQ(poses_in_mcap(log), range(0, 20));
  const logs::RawTopic& topic = topic_of(log, "/cf1/pose");
  EXPECT_EQ(topic.type, "geometry_msgs/msg/PoseStamped");
  EXPECT_EQ(topic.time_s[3], 1.03);
  EXPECT_EQ(values_of(topic, "header.stamp")[0], 5.25);
  EXPECT_EQ(log.health.records, 20u);
  EXPECT_EQ(log.health.damaged_blocks + log.health.skipped_bytes, 0u);
  EXPECT_FALSE(log.health.truncated || log.health.checksum_failed);
}

/// The numbers are those written by the generator of these files.
TEST(Mcap, ReadsWhatTheReferenceWriterWrote) {
  for (const char* const name : {"reference_zstd.mcap", "reference_lz4.mcap"}) {
    const logs::RawLog log = logs::read_raw(source_path(std::string("tests/logs/data/") + name));
    EXPECT_EQ(broken_rule(log), "");
    EXPECT_EQ(log.health.records, 36u);
    EXPECT_EQ(log.health.damaged_blocks, 0u);
    EXPECT_FALSE(log.health.truncated || log.health.checksum_failed);
    ASSERT_EQ(log.left_out.size(), 1u);
    EXPECT_EQ(log.left_out[0].name, "/json");
    EXPECT_EQ(poses_in_mcap(log), range(0, 12));
    const logs::RawTopic& mixed = topic_of(log, "/mixed");
    for (int k = 0; k < 12; ++k) {
      const auto i = static_cast<std::size_t>(k);
      EXPECT_EQ(topic_of(log, "/cf1/log").time_s[i], (1700000000000000000.0 + 10000000.0 * k) / 1e9);
      EXPECT_EQ(values_in(log, "/cf1/log", "timestamp")[i], 1000 + 10 * k);
      EXPECT_EQ(values_in(log, "/cf1/log", "values[2]")[i], k / 4.0);
      EXPECT_EQ(values_of(mixed, "b")[i], -k);
      EXPECT_EQ(values_of(mixed, "bounded[1]")[i], k);
      EXPECT_EQ(values_of(mixed, "three[2]")[i], k);
      EXPECT_EQ(values_of(mixed, "big")[i], 5e9 + k);
      EXPECT_EQ(values_of(mixed, "parts[1].i")[i], 1 - k);
      EXPECT_EQ(values_of(mixed, "parts[1].d")[i], k * 1e100);
      EXPECT_EQ(values_of(mixed, "flag")[i], k % 2);
      EXPECT_EQ(std::isnan(values_of(mixed, "many[1]")[i]), k % 3 < 2);
      if (k % 3 == 2) {
        EXPECT_EQ(values_of(mixed, "many[1]")[i], k + 0.5);
      }
    }
  }
}

TEST(Mcap, AChunkThatFailsItsChecksumIsLeftOut) {
  std::string bytes = small_mcap();
  const std::string chunk = mcap_chunk(mcap_poses(12, 20));
  bytes[bytes.find(chunk) + chunk.size() - 3] ^= 1;
  const logs::RawLog log = mcap_of(bytes);
  EXPECT_EQ(poses_in_mcap(log), range(0, 12));
  EXPECT_EQ(log.health.damaged_blocks, 1u);
  EXPECT_TRUE(log.health.checksum_failed) << "that of the data section covers the chunk";
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_NE(log.left_out[0].why.find("checksum"), std::string::npos);
}

TEST(Mcap, DefinitionsOfADamagedChunkAreTakenFromElsewhere) {
  // The definitions are in the first chunk, which is damaged, and in the summary.
  std::string first = mcap_chunk(mcap_pose_definitions() + mcap_poses(0, 5));
  first[first.size() - 1] ^= 1;
  const logs::RawLog log = mcap_of(mcap_magic() + mcap_header() + first + mcap_chunk(mcap_poses(5, 9)) +
                                   mcap_record(0x0F, bytes_of(0)) + mcap_pose_definitions() +
                                   mcap_record(0x02, std::string(20, '\0')) + mcap_magic());
  EXPECT_EQ(poses_in_mcap(log), range(5, 9));
}

TEST(Mcap, EndingAnywhereKeepsTheMessagesBefore) {
  const std::string bytes = small_mcap();
  std::size_t last = 0;
  for (std::size_t size = mcap_magic().size(); size < bytes.size(); ++size) {
    const logs::RawLog log = mcap_of(bytes.substr(0, size));
    const std::vector<double> found = poses_in_mcap(log);
    EXPECT_EQ(found, range(0, static_cast<int>(found.size()))) << size;
    EXPECT_GE(found.size(), last) << size;
    EXPECT_TRUE(log.health.truncated) << size;
    EXPECT_EQ(log.health.damaged_blocks, 0u) << size;
    last = found.size();
  }
  EXPECT_EQ(last, 20u);
}

TEST(Mcap, ACompressedChunkThatTheFileCutsShortIsReadAsFarAsItGoes) {
  const std::string whole = logs::read_raw(source_path("tests/logs/data/reference_zstd.mcap")).format;
  ASSERT_EQ(whole, "mcap");
  std::ifstream file(source_path("tests/logs/data/reference_lz4.mcap"), std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  std::size_t last = 0, larger = 0;
  for (std::size_t size = 8; size < bytes.size(); size += 7) {
    const logs::RawLog log = mcap_of(bytes.substr(0, size));
    EXPECT_EQ(broken_rule(log), "");
    EXPECT_GE(log.health.records, last) << size;
    larger += log.health.records > last ? 1 : 0;
    last = log.health.records;
  }
  EXPECT_EQ(last, 36u);
  EXPECT_GE(larger, 8u);
}

TEST(Mcap, FindsItsWayAfterDamageOutsideChunks) {
  const std::string junk(500, '\x05');
  const logs::RawLog log = mcap_of(pose_file(mcap_poses(0, 5) + junk + mcap_poses(5, 10)));
  EXPECT_EQ(poses_in_mcap(log), range(0, 10));
  EXPECT_EQ(log.health.damaged_blocks, 1u);
  EXPECT_EQ(log.health.skipped_bytes, 500u);
}

TEST(Mcap, NamesTopicsThatItCannotRead) {
  const logs::RawLog log = mcap_of(pose_file(
      mcap_channel(2, 0, "/json", "json") + mcap_channel(3, 9, "/no_schema") +
      mcap_schema(4, "odd/msg/Type", "wstring x\n") + mcap_channel(4, 4, "/odd") +
      mcap_schema(5, "nav_msgs/msg/Odometry", "whatever", "ros2idl") + mcap_channel(5, 5, "/odometry") +
      mcap_message(2, 1, "{}") + mcap_message(3, 1, "x") + mcap_message(4, 1, "x") + mcap_message(7, 1, "x") +
      mcap_message(7, 1, "x") + mcap_chunk("some", "xz", "some") + mcap_poses(0, 2)));
  EXPECT_EQ(poses_in_mcap(log), range(0, 2));
  std::map<std::string, std::string> why;
  for (const logs::LeftOut& skip : log.left_out) why[skip.name] = skip.why;
  EXPECT_NE(why["/json"].find("encoding"), std::string::npos);
  EXPECT_NE(why["/no_schema"].find("lost the definition"), std::string::npos);
  EXPECT_NE(why["/odd"].find("cannot be used"), std::string::npos);
  EXPECT_NE(why["channel 7"].find("lost the record"), std::string::npos);
  EXPECT_TRUE(std::any_of(log.left_out.begin(), log.left_out.end(), [](const logs::LeftOut& one) {
    return one.why.find("\"xz\"") != std::string::npos;
  }));
  EXPECT_EQ(why.count("/odometry"), 0u) << "its type is known here, whatever language its definition has";
}

TEST(Mcap, ChannelsOfOneTopicAreInstances) {
  const logs::RawLog log = mcap_of(
      pose_file(mcap_channel(2, 1, "/cf1/pose") + mcap_poses(0, 3) + mcap_message(2, 1, cdr_pose(7, 0, 0))));
  EXPECT_EQ(values_of(topic_of(log, "/cf1/pose", 0), "pose.position.x"), range(0, 3));
  EXPECT_EQ(values_of(topic_of(log, "/cf1/pose", 1), "pose.position.x"), std::vector<double>{7});
}

TEST(Mcap, SizesOfChunksAreNotBelieved) {
  const std::string records = mcap_poses(0, 4);
  std::string large = mcap_chunk(records);
  large.replace(9 + 16, 8, bytes_of(~std::uint64_t{0}));  // the stated uncompressed size
  const logs::RawLog log = mcap_of(pose_file(large + mcap_poses(4, 6)));
  EXPECT_EQ(poses_in_mcap(log), range(4, 6));
  EXPECT_EQ(log.health.damaged_blocks, 1u);
}

TEST(Mcap, RefusesWhatItCannotRead) {
  EXPECT_TRUE(refuses([] { mcap_of("\x89MCAP1\r\n"); }, {"offset 0", "magic number"}));
}

TEST(Mcap, EveryDamagedByteGivesALogOrARefusal) {
  const std::string sound = small_mcap();
  int complete = 0;
  for (std::size_t i = 0; i < sound.size(); ++i) {
    std::string bytes = sound;
    bytes[i] = static_cast<char>(bytes[i] ^ (i % 2 == 0 ? 0x80 : 0x03));
    try {
      const logs::RawLog log = mcap_of(bytes);
      EXPECT_EQ(broken_rule(log), "") << "byte " << i;
      complete += log.health.records == 20 ? 1 : 0;
    } catch (const files::InputError&) {
      EXPECT_LT(i, mcap_magic().size());
    }
  }
  EXPECT_GT(complete, 100) << "damage to values is seen by the checksum only";
}

TEST(Mcap, IsRecognisedByContent) {
  EXPECT_TRUE(logs::looks_like_mcap(small_mcap()));
  EXPECT_FALSE(logs::looks_like_mcap("\x89MCAP"));
  std::istringstream in(small_mcap());
  EXPECT_EQ(logs::parse_raw(in, "x").format, "mcap");
}

}  // namespace
}  // namespace swarmcert::tests

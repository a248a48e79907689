#include <gtest/gtest.h>

#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "data.h"
#include "logs/raw_log_invariant.h"
#include "logs/topics.h"
#include "logs/ulog_writer.h"
#include "nn/refusal.h"

namespace swarmcert::tests {
namespace {

logs::RawLog ulog_of(std::string bytes) { return logs::read_ulog(bytes, "flight.ulg"); }

/// Returns the numbers of the topic "count" that were read.
std::vector<double> counts_in_ulog(const logs::RawLog& log) { return values_in(log, "count", "number"); }

std::string count_log(const std::string& data) { return ulog_head() + ulog_count_definitions() + data; }

TEST(Ulog, GivesRecordsWithTheirTimesInSeconds) {
  const logs::RawLog log = ulog_of(count_log(ulog_counts(0, 3)));
  EXPECT_EQ(log.format, "ulog");
  EXPECT_EQ(topic_of(log, "count").time_s, (std::vector<double>{1.0, 1.01, 1.02}));
  EXPECT_EQ(counts_in_ulog(log), range(0, 3));
  EXPECT_EQ(log.health.records, 3u);
}

TEST(Ulog, FlattensNestedTypesAndArraysAndLeavesOutPadding) {
  const logs::RawLog log = ulog_of(small_ulog());
  const logs::RawTopic& whole = topic_of(log, "whole", 1);
  EXPECT_EQ(column_names(whole),
            (std::vector<std::string>{"parts[0].pair[0]", "parts[0].pair[1]", "parts[1].pair[0]",
                                      "parts[1].pair[1]", "large", "flag"}));
  EXPECT_EQ(values_of(whole, "parts[1].pair[1]"), std::vector<double>{-4});
  EXPECT_EQ(values_of(whole, "large"), std::vector<double>{1e300});
  EXPECT_EQ(values_of(whole, "flag"), std::vector<double>{1});
}

TEST(Ulog, ReadsEveryTypeOfNumber) {
  const std::string fields = bytes_of(std::int8_t{-1}) + bytes_of(std::uint8_t{255}) +
                             bytes_of(std::int16_t{-300}) + bytes_of(std::uint16_t{65535}) +
                             bytes_of(std::int32_t{-70000}) + bytes_of(std::uint32_t{4294967295}) +
                             bytes_of(std::int64_t{-5'000'000'000}) + bytes_of(std::uint64_t{5'000'000'000}) +
                             bytes_of(1.5f) + bytes_of(-2.5) + '\1';
  const logs::RawLog log =
      ulog_of(ulog_head() +
              ulog_format("all:uint64_t timestamp;int8_t a;uint8_t b;int16_t c;uint16_t d;int32_t e;"
                          "uint32_t f;int64_t g;uint64_t h;float i;double j;bool k;") +
              ulog_subscription(1, "all") + ulog_record(1, 0, fields));
  std::vector<double> found;
  for (const logs::RawColumn& column : topic_of(log, "all").columns) found.push_back(column.values.at(0));
  EXPECT_EQ(found, (std::vector<double>{-1, 255, -300, 65535, -70000, 4294967295, -5e9, 5e9, 1.5, -2.5, 1}));
}

TEST(Ulog, KeepsInstancesOfATopicApart) {
  std::string bytes = ulog_head() + ulog_format("count:uint64_t timestamp;float number;");
  for (const int instance : {0, 1, 3}) {
    const auto id = static_cast<std::uint16_t>(10 + instance);
    bytes += ulog_subscription(id, "count", static_cast<std::uint8_t>(instance));
  }
  for (const int instance : {3, 0, 1})
    bytes +=
        ulog_record(static_cast<std::uint16_t>(10 + instance), 1, bytes_of(static_cast<float>(instance)));
  const logs::RawLog log = ulog_of(bytes);
  ASSERT_EQ(log.topics.size(), 3u);
  for (const int instance : {0, 1, 3})
    EXPECT_EQ(values_of(topic_of(log, "count", instance), "number"), std::vector<double>{1.0 * instance});
}

TEST(Ulog, ReadsParametersOfTheStartAndDropouts) {
  const logs::RawLog log = ulog_of(small_ulog());
  EXPECT_EQ(log.parameters, (std::map<std::string, double>{{"MASS", 0.5}, {"ROTORS", 4}}));
  EXPECT_EQ(log.health.dropouts_s, 0.25);
  EXPECT_TRUE(log.left_out.empty());
  EXPECT_EQ(log.health.damaged_blocks, 0u);
}

TEST(Ulog, SkipsMessagesOfUnknownTypesAndNamesThem) {
  const logs::RawLog log =
      ulog_of(count_log(ulog_counts(0, 5) + ulog_message('z', "of a later version") + ulog_counts(5, 9)));
  EXPECT_EQ(counts_in_ulog(log), range(0, 9));
  EXPECT_EQ(log.health.damaged_blocks, 0u);
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_EQ(log.left_out[0].name, "message type 0x7a");
}

TEST(Ulog, NamesTopicsWhoseDefinitionIsLost) {
  // Records with id 9 have no subscription; those with id 8 have a format that uses an undefined one.
  std::string data;
  for (int k = 0; k < 10; ++k) {
    data += ulog_counts(k, k + 1) + ulog_record(9, 1, "some bytes") + ulog_record(9, 2, "some bytes") +
            ulog_record(8, 1, "xyz");
  }
  const logs::RawLog log =
      ulog_of(ulog_head() + ulog_count_definitions() + ulog_format("odd:uint64_t timestamp;lost part;") +
              ulog_subscription(8, "odd") + data);
  EXPECT_EQ(counts_in_ulog(log), range(0, 10));
  EXPECT_EQ(log.health.damaged_blocks, 0u);
  ASSERT_EQ(log.left_out.size(), 2u);
  EXPECT_EQ(log.left_out[0].name, "message id 9");
  EXPECT_EQ(log.left_out[0].records, 20u);
  EXPECT_EQ(log.left_out[1].name, "odd");
  EXPECT_EQ(log.left_out[1].records, 10u);
}

TEST(Ulog, AFormatMayComeAfterTheOneThatUsesIt) {
  const logs::RawLog log = ulog_of(ulog_head() + ulog_format("outer:uint64_t timestamp;inner part;") +
                                   ulog_format("inner:float x;") + ulog_subscription(1, "outer") +
                                   ulog_record(1, 1, bytes_of(2.5f)));
  EXPECT_EQ(values_of(topic_of(log, "outer"), "part.x"), std::vector<double>{2.5});
}

TEST(Ulog, FindsItsWayAfterDamageAndCountsIt) {
  const std::string head = count_log("");
  const std::size_t record_bytes = ulog_counts(0, 1).size();
  for (std::size_t byte = 0; byte < 3; ++byte) {  // of the message header: size and type
    std::string bytes = head + ulog_counts(0, 20);
    bytes[head.size() + 10 * record_bytes + byte] ^= 0x55;
    const logs::RawLog log = ulog_of(bytes);
    EXPECT_EQ(counts_in_ulog(log), joined(range(0, 10), range(11, 20))) << byte;
    EXPECT_FALSE(log.health.truncated) << byte;
    if (byte == 2) continue;  // the type: damage cannot be distinguished from a later version
    EXPECT_EQ(log.health.damaged_blocks, 1u) << byte;
    EXPECT_EQ(log.health.skipped_bytes, record_bytes) << byte;
  }
}

TEST(Ulog, BytesThatBelongNowhereCostNoRecord) {
  const logs::RawLog log =
      ulog_of(count_log(ulog_counts(0, 10) + std::string(1000, '\xA5') + ulog_counts(10, 20)));
  EXPECT_EQ(counts_in_ulog(log), range(0, 20));
  EXPECT_EQ(log.health.damaged_blocks, 1u);
  EXPECT_EQ(log.health.skipped_bytes, 1000u);
}

TEST(Ulog, EndingAnywhereKeepsTheWholeRecords) {
  const std::string head = count_log("");
  const std::string bytes = head + ulog_counts(0, 8);
  const std::size_t record_bytes = ulog_counts(0, 1).size();
  for (std::size_t size = head.size(); size <= bytes.size(); ++size) {
    const logs::RawLog log = ulog_of(bytes.substr(0, size));
    const std::size_t whole = (size - head.size()) / record_bytes;
    EXPECT_EQ(counts_in_ulog(log), range(0, static_cast<int>(whole))) << size;
    EXPECT_EQ(log.health.truncated, (size - head.size()) % record_bytes != 0) << size;
    EXPECT_EQ(log.health.damaged_blocks, 0u) << size;
  }
}

TEST(Ulog, ReadsSectionsThatWereAppendedAfterACrash) {
  // The vehicle stopped within the fifth record; the data still in memory was appended after the next start.
  const std::string definitions = ulog_count_definitions();
  const std::string cut = ulog_counts(0, 4) + ulog_counts(4, 5).substr(0, 9);
  const std::size_t flags_bytes = ulog_flags(0, 0).size();
  const std::uint64_t first = ulog_head().size() + flags_bytes + definitions.size() + cut.size();
  const std::string appended = ulog_counts(5, 8);
  const std::string bytes = ulog_head() + ulog_flags(0, 1, {first, first + appended.size()}) + definitions +
                            cut + appended + ulog_counts(8, 10);
  const logs::RawLog log = ulog_of(bytes);
  EXPECT_EQ(counts_in_ulog(log), joined(range(0, 4), range(5, 10)));
  EXPECT_EQ(log.health.damaged_blocks, 0u);
  EXPECT_EQ(log.health.skipped_bytes, 9u);
  EXPECT_FALSE(log.health.truncated);
}

TEST(Ulog, OffsetsOfAppendedSectionsAreNotTrusted) {
  const std::string rest = ulog_count_definitions() + ulog_counts(0, 5);
  for (const std::vector<std::uint64_t>& offsets :
       {std::vector<std::uint64_t>{~std::uint64_t{0}}, {1}, {16, 16, 16}, {1u << 31}}) {
    const logs::RawLog log = ulog_of(ulog_head() + ulog_flags(0, 1, offsets) + rest);
    EXPECT_EQ(counts_in_ulog(log), range(0, 5)) << offsets[0];
    EXPECT_TRUE(log.health.truncated || log.health.damaged_blocks > 0) << offsets[0];
  }
}

TEST(Ulog, RefusesWhatItCannotRead) {
  EXPECT_TRUE(refuses([] { ulog_of("ULag\x01\x12\x35 and more"); }, {"offset 0", "magic number", "PX4"}));
  EXPECT_TRUE(
      refuses([] { ulog_of(ulog_head().substr(0, 12)); }, {"offset 12", "ends inside", "copy it again"}));
  EXPECT_TRUE(refuses([] { ulog_of(ulog_head(9)); }, {"offset 7", "version = 9", "supported are 0 and 1"}));
  EXPECT_TRUE(refuses([] { ulog_of(ulog_head() + ulog_flags(0, 0x42)); },
                      {"offset 27", "incompatible flags = 0x42", "feature", "convert"}));
}

TEST(Ulog, FormatsThatCannotBeAreNotBelieved) {
  const std::string record = ulog_record(1, 1, std::string(24, '\1'));
  const std::string chain = [] {
    std::string formats = ulog_format("f0:uint64_t timestamp;f1 x;");
    for (int i = 1; i < 40; ++i)
      formats += ulog_format("f" + std::to_string(i) + ":f" + std::to_string(i + 1) + " x;");
    return formats + ulog_format("f40:float x;");
  }();
  for (const std::string& formats :
       {ulog_format("f0:uint64_t timestamp;f0 x;"), ulog_format("f0:a x;") + ulog_format("a:f0 x;"), chain,
        ulog_format("f0:uint64_t timestamp;float[60000] x;"),
        ulog_format("f0:uint64_t timestamp;float[-1] x;"),
        ulog_format("f0:uint64_t timestamp;float[99999999999999999999] x;"), ulog_format("f0:uint64_t;"),
        ulog_format("f0:uint64_t timestamp;float x;float x;"),
        ulog_format("f0:uint64_t timestamp;float[4 x;")}) {
    const logs::RawLog log = ulog_of(ulog_head() + formats + ulog_subscription(1, "f0") + record + record +
                                     ulog_count_definitions() + ulog_counts(0, 4));
    EXPECT_EQ(log.topics.size(), 1u) << formats.substr(0, 60);
    EXPECT_EQ(counts_in_ulog(log), range(0, 4)) << formats.substr(0, 60);
    EXPECT_FALSE(log.left_out.empty()) << formats.substr(0, 60);
  }
}

TEST(Ulog, LargeArraysAreNamedAndEmptyElementsCostNothing) {
  const logs::RawLog log =
      ulog_of(ulog_head() + ulog_format("e:float[0] a;float[0] b;") + ulog_format("d:e[60000] x;") +
              ulog_format("f:uint64_t timestamp;uint8_t[1000] dump;d[60000] nothing;float x;") +
              ulog_subscription(1, "f") + ulog_record(1, 1, std::string(1000, 'x') + bytes_of(2.5f)));
  ASSERT_EQ(topic_of(log, "f").columns.size(), 1u);
  EXPECT_EQ(values_of(topic_of(log, "f"), "x"), std::vector<double>{2.5});
  ASSERT_EQ(log.left_out.size(), 1u);
  EXPECT_EQ(log.left_out[0].name, "f.dump");
}

TEST(Ulog, EveryDamagedByteGivesALogOrARefusal) {
  const std::string sound = small_ulog();
  const std::size_t all = ulog_of(sound).health.records;
  std::size_t least = all;
  int refused = 0;
  for (std::size_t i = 0; i < sound.size(); ++i) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      std::string bytes = sound;
      bytes[i] = static_cast<char>(bytes[i] ^ flip);
      try {
        const logs::RawLog log = ulog_of(bytes);
        EXPECT_EQ(broken_rule(log), "") << "byte " << i;
        if (i > sound.size() / 2) least = std::min(least, log.health.records);
      } catch (const files::InputError&) {
        ++refused;
      }
    }
  }
  EXPECT_GE(least + 2, all) << "damage among the records costs one or two of them";
  EXPECT_GT(refused, 8 * 3 - 1) << "magic number and version";
}

TEST(Ulog, IsRecognisedByContent) {
  EXPECT_TRUE(logs::looks_like_ulog(small_ulog()));
  EXPECT_FALSE(logs::looks_like_ulog("ULog"));
  std::istringstream in(small_ulog());
  EXPECT_EQ(logs::parse_raw(in, "x").format, "ulog");
}

/// Counts and values according to the reference reader @foxglove/ulog 2.1.
TEST(Ulog, ReadsTheRecordedLogsAsTheReferenceReaderDoes) {
  SWARMCERT_NEEDS_DATA();
  const logs::RawLog log = logs::read_raw(data_path("collections/px4/sample.ulg"));
  EXPECT_EQ(log.health.records, 64542u);
  EXPECT_EQ(log.topics.size(), 15u);
  EXPECT_EQ(log.parameters.size(), 493u);
  EXPECT_GT(log.health.dropouts_s, 0);
  const logs::RawLog simulated = logs::read_raw(data_path("collections/px4/sample_px4_events.ulg"));
  EXPECT_EQ(simulated.health.records, 29480u);
  EXPECT_EQ(simulated.topics.size(), 69u);
  EXPECT_EQ(simulated.parameters.size(), 875u);
  for (const logs::RawLog* const each : {&log, &simulated}) {
    EXPECT_EQ(broken_rule(*each), "");
    EXPECT_TRUE(each->left_out.empty());
    EXPECT_EQ(each->health.damaged_blocks + each->health.skipped_bytes, 0u);
  }
}

}  // namespace
}  // namespace swarmcert::tests

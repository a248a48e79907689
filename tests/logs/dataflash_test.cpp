#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "logs/dataflash_writer.h"
#include "logs/raw_log_invariant.h"
#include "logs/topics.h"
#include "nn/refusal.h"

namespace swarmcert::tests {
namespace {

logs::RawLog dataflash_of(std::string bytes) { return logs::read_dataflash(bytes, "flight.bin"); }

std::vector<double> counts_in_dataflash(const logs::RawLog& log) { return values_in(log, "CNT", "Number"); }

TEST(Dataflash, GivesTopicsWithTheirTimesInSeconds) {
  const logs::RawLog log = dataflash_of(dataflash_definitions() + dataflash_counts(0, 3));
  EXPECT_EQ(log.format, "ardupilot");
  EXPECT_EQ(topic_of(log, "CNT").time_s, (std::vector<double>{1.0, 1.01, 1.02}));
  EXPECT_EQ(counts_in_dataflash(log), range(0, 3));
}

TEST(Dataflash, AppliesMultipliersAndScalesOfTypes) {
  const logs::RawLog log = dataflash_of(small_dataflash());
  const logs::RawTopic& first = topic_of(log, "XKF1", 0);
  EXPECT_EQ(values_of(first, "VN"), std::vector<double>{1.5});
  EXPECT_EQ(values_of(first, "PD"), std::vector<double>{-2.0}) << "PD has the multiplier 0.01";
  const logs::RawTopic& attitude = topic_of(log, "ATT");
  EXPECT_EQ(values_of(attitude, "Roll"), std::vector<double>{-12.34}) << "0.01 of the type, not twice";
  EXPECT_EQ(values_of(attitude, "Yaw"), std::vector<double>{359.99});
}

TEST(Dataflash, KeepsInstancesApart) {
  const logs::RawLog log = dataflash_of(small_dataflash());
  EXPECT_EQ(values_of(topic_of(log, "XKF1", 1), "VN"), std::vector<double>{2.5});
  EXPECT_EQ(topic_of(log, "XKF1", 1).type, "XKF1");
}

TEST(Dataflash, ReadsTheFirstParametersAndMessages) {
  const logs::RawLog log = dataflash_of(small_dataflash());
  EXPECT_EQ(log.parameters, (std::map<std::string, double>{{"MOT_THST_HOVER", static_cast<double>(0.35f)}}));
  ASSERT_EQ(log.messages.size(), 1u);
  EXPECT_EQ(log.messages[0], "ArduCopter V4");
}

TEST(Dataflash, ReadsEveryTypeOfField) {
  std::string samples;
  for (std::int16_t i = 0; i < 32; ++i) samples += bytes_of(i);
  const std::string body =
      bytes_of(std::uint64_t{1}) + bytes_of(std::int8_t{-1}) + bytes_of(std::uint8_t{255}) +
      bytes_of(std::int16_t{-2}) + bytes_of(std::uint16_t{3}) + bytes_of(std::int32_t{-4}) +
      bytes_of(std::uint32_t{5}) + bytes_of(std::int64_t{-6}) + bytes_of(0.5f) + bytes_of(0.25) +
      bytes_of(std::uint16_t{0xC100}) + bytes_of(std::int16_t{-250}) + bytes_of(std::int32_t{123456789});
  const logs::RawLog log = dataflash_of(
      dataflash_definitions() +
      dataflash_format(20, static_cast<std::uint8_t>(3 + body.size()), "ALL", "QbBhHiIqfdgcL",
                       "TimeUS,a,b,c,d,e,f,g,h,i,j,k,l") +
      dataflash_format(21, 3 + 8 + 64 + 4 + 16, "TXT", "QanN", "TimeUS,samples,short,long") +
      dataflash_message(20, body) +
      dataflash_message(21, bytes_of(std::uint64_t{1}) + samples + "abcd" + fixed_text("name", 16)));
  std::vector<double> values;
  for (const logs::RawColumn& column : topic_of(log, "ALL").columns) values.push_back(column.values.at(0));
  const std::vector<double> expected = {-1, 255, -2, 3, -4, 5, -6, 0.5, 0.25, -2.5, -2.5, 12.3456789};
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_DOUBLE_EQ(values[i], expected[i]) << i;
  EXPECT_EQ(values_in(log, "TXT", "samples[31]"), std::vector<double>{31});
}

TEST(Dataflash, HalfFloatsAreThoseOfIeee754) {
  // Sign, largest, smallest normal, smallest subnormal, infinity.
  const std::vector<std::pair<std::uint16_t, double>> cases = {{0x3C00, 1},
                                                               {0xC000, -2},
                                                               {0x7BFF, 65504},
                                                               {0x0400, std::ldexp(1, -14)},
                                                               {0x0001, std::ldexp(1, -24)},
                                                               {0x7C00, INFINITY}};
  std::string bytes = dataflash_definitions() + dataflash_format(20, 13, "HLF", "Qg", "TimeUS,x");
  for (const auto& [bits, value] : cases)
    bytes += dataflash_message(20, bytes_of(std::uint64_t{1}) + bytes_of(bits));
  const logs::RawLog log = dataflash_of(bytes);
  const std::vector<double> values = values_in(log, "HLF", "x");
  ASSERT_EQ(values.size(), cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(values[i], cases[i].second);
}

TEST(Dataflash, DefinitionsMayComeAfterTheMessagesThatNeedThem) {
  const std::string late = dataflash_format(30, 15, "NEW", "Qf", "TimeUS,x");
  const std::string early = dataflash_message(30, bytes_of(std::uint64_t{1}) + bytes_of(2.5f));
  const logs::RawLog log = dataflash_of(dataflash_definitions() + early + dataflash_counts(0, 2) + late);
  EXPECT_EQ(values_in(log, "NEW", "x"), std::vector<double>{2.5});
  EXPECT_EQ(counts_in_dataflash(log), range(0, 2));
}

TEST(Dataflash, NamesWhatItCannotRead) {
  std::string bytes = dataflash_definitions() + dataflash_format(31, 14, "ODD", "Qf", "TimeUS,x") +
                      dataflash_format(32, 7, "NOT", "f", "x");
  for (int k = 0; k < 3; ++k) {
    bytes += dataflash_message(99, "unknown") + dataflash_message(99, "unknown") +
             dataflash_counts(k, k + 1) + dataflash_message(31, "12345678901") +
             dataflash_message(32, "1234");
  }
  const logs::RawLog log = dataflash_of(bytes + dataflash_counts(3, 5));
  EXPECT_EQ(counts_in_dataflash(log), range(0, 5));
  std::map<std::string, std::size_t> records;
  for (const logs::LeftOut& skip : log.left_out) records[skip.name] = skip.records;
  EXPECT_EQ(records, (std::map<std::string, std::size_t>{{"message id 99", 6}, {"ODD", 3}, {"NOT", 3}}));
  EXPECT_EQ(log.health.damaged_blocks, 0u);
}

TEST(Dataflash, DefinitionsThatContradictThemselvesAreNotUsed) {
  const std::string counts_10 = dataflash_counts(0, 10);
  for (const std::string& format :
       {dataflash_format(40, 2, "BAD", "Q", "TimeUS"), dataflash_format(40, 15, "B D", "Qf", "TimeUS,x"),
        dataflash_format(40, 15, "BAD", "Qf", "TimeUS,x,y"), dataflash_format(40, 15, "BAD", "Qf", "TimeUS"),
        dataflash_format(40, 15, "BAD", "Q?", "TimeUS,x"),
        dataflash_format(40, 19, "BAD", "Qff", "TimeUS,x,x"),
        dataflash_format(10, 19, "CNT", "Qff", "TimeUS,x,y")}) {
    const logs::RawLog log = dataflash_of(dataflash_definitions() + format + counts_10);
    EXPECT_EQ(counts_in_dataflash(log), range(0, 10));
    EXPECT_EQ(log.topics.size(), 1u);
  }
}

TEST(Dataflash, FindsItsWayAfterDamageAndCountsIt) {
  const logs::RawLog log = dataflash_of(dataflash_definitions() + dataflash_counts(0, 10) +
                                        std::string(333, '\xA3') + dataflash_counts(10, 20));
  EXPECT_EQ(log.health.damaged_blocks, 1u);
  // The message before the damage cannot be distinguished from one with a wrong length.
  EXPECT_EQ(counts_in_dataflash(log), joined(range(0, 9), range(10, 20)));
  EXPECT_EQ(log.health.skipped_bytes, 333u + dataflash_counts(0, 1).size());
}

TEST(Dataflash, EndingAnywhereKeepsTheWholeMessages) {
  const std::string head = dataflash_definitions();
  const std::string bytes = head + dataflash_counts(0, 8);
  const std::size_t message_bytes = dataflash_counts(0, 1).size();
  for (std::size_t size = head.size(); size <= bytes.size(); ++size) {
    const logs::RawLog log = dataflash_of(bytes.substr(0, size));
    EXPECT_EQ(counts_in_dataflash(log), range(0, static_cast<int>((size - head.size()) / message_bytes)))
        << size;
    EXPECT_EQ(log.health.truncated, (size - head.size()) % message_bytes != 0) << size;
  }
}

TEST(Dataflash, RefusesWhatItCannotRead) {
  EXPECT_TRUE(refuses([] { dataflash_of("\xA3\x95\x05 something"); },
                      {"offset 0", "format definition", "ArduPilot"}));
}

TEST(Dataflash, EveryDamagedByteGivesALogOrARefusal) {
  const std::string sound = small_dataflash();
  const std::size_t all = dataflash_of(sound).health.records;
  int refused = 0, complete = 0;
  for (std::size_t i = 0; i < sound.size(); ++i) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      std::string bytes = sound;
      bytes[i] = static_cast<char>(bytes[i] ^ flip);
      try {
        const logs::RawLog log = dataflash_of(bytes);
        EXPECT_EQ(broken_rule(log), "") << "byte " << i;
        complete += log.health.records == all ? 1 : 0;
      } catch (const files::InputError&) {
        ++refused;
      }
    }
  }
  EXPECT_EQ(refused, 9) << "the three bytes by which the format is known";
  EXPECT_GT(complete, 1000) << "values have no checksum";
}

TEST(Dataflash, IsRecognisedByContent) {
  EXPECT_TRUE(logs::looks_like_dataflash(small_dataflash()));
  EXPECT_FALSE(logs::looks_like_dataflash("\xA3\x95"));
  std::istringstream in(small_dataflash());
  EXPECT_EQ(logs::parse_raw(in, "x").format, "ardupilot");
}

}  // namespace
}  // namespace swarmcert::tests

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>

#include "analysis/log_writer.h"
#include "analysis/logs/read_log.h"
#include "analysis/run.h"
#include "data.h"
#include "nn/base/input_error.h"

namespace swarmcert::tests {
namespace {

logs::Log parse(const std::string& bytes, const logs::SignalMap& map = {}) {
  std::istringstream in(bytes);
  return logs::parse_log(in, "cf1_00", map);
}

std::string refusal(const std::string& bytes) {
  try {
    parse(bytes);
  } catch (const files::InputError& error) {
    return error.what();
  }
  return "accepted";
}

/// x of every surviving sample in millimetres, which is the number of its record.
std::vector<int> survivors(const logs::Log& log) {
  std::vector<int> numbers;
  for (const logs::Sample& sample : log.samples)
    numbers.push_back(static_cast<int>(std::lround(1000 * sample.position_m[0])));
  return numbers;
}

std::vector<int> without(int count, const std::vector<int>& missing) {
  std::vector<int> numbers;
  for (int k = 0; k < count; ++k) {
    if (std::find(missing.begin(), missing.end(), k) == missing.end()) numbers.push_back(k);
  }
  return numbers;
}

constexpr std::size_t kBlock_bytes = 1 + 2 * 16 + 4;

TEST(UsdLog, GivesTheAuthorsCsvByteByByte) {
  SWARMCERT_NEEDS_DATA();
  for (const auto& [log_name, csv_name] : {std::pair{"21_swap_ll/cf101_00", "swap_ll_cf101_00"},
                                           std::pair{"21_swap_ll/cf102_00", "swap_ll_cf102_00"},
                                           std::pair{"21_swap_ss/cf50_00", "swap_ss_cf50_00"},
                                           std::pair{"21_swap_ss/cf51_00", "swap_ss_cf51_00"}}) {
    const logs::Log log = logs::read_log(data_path(std::string("flights/development/") + log_name));
    std::ostringstream text;
    logs::write_csv(log, -1e9, 1e9, text);
    EXPECT_TRUE(text.str() == read_text(data_path(std::string("csv/") + csv_name + ".csv"))) << log_name;
  }
}

TEST(UsdLog, AndTheAuthorsCsvGiveTheSameSamples) {
  SWARMCERT_NEEDS_DATA();
  const logs::Log binary = logs::read_log(data_path("flights/development/21_swap_ss/cf51_00"));
  const logs::Log csv = logs::read_log(data_path("csv/swap_ss_cf51_00.csv"));
  ASSERT_EQ(binary.samples.size(), csv.samples.size());
  for (std::size_t i = 0; i < csv.samples.size(); ++i) {
    EXPECT_EQ(binary.samples[i].time_us, csv.samples[i].time_us);
    EXPECT_EQ(binary.samples[i].specific_force_m_s2, csv.samples[i].specific_force_m_s2);
    EXPECT_EQ(binary.samples[i].attitude.xyzw(), csv.samples[i].attitude.xyzw());
    EXPECT_EQ(binary.samples[i].duty, csv.samples[i].duty);
    EXPECT_EQ(binary.samples[i].restarts, csv.samples[i].restarts);
  }
}

TEST(UsdLog, EveryRecordedFlightIsReadWithoutDamage) {
  SWARMCERT_NEEDS_DATA();
  int read = 0;
  for (const char* folder : {"flights/development", "flights/visible_test"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data_path(folder))) {
      if (!entry.is_regular_file()) continue;
      const logs::Log log = logs::read_log(entry.path().string());
      EXPECT_TRUE(logs::is_sound(log.health)) << entry.path();
      EXPECT_TRUE(log.signals.force && log.signals.targets && log.signals.commands) << entry.path();
      ++read;
    }
  }
  EXPECT_EQ(read, 230);
}

TEST(UsdLog, ADamagedBlockIsSkippedAndTheRestIsKept) {
  const std::string header = usd_header();
  for (std::size_t at = 3 * kBlock_bytes; at < 4 * kBlock_bytes; ++at) {
    std::string bytes = small_usd();
    bytes[header.size() + at] = static_cast<char>(bytes[header.size() + at] ^ 0x10);
    const logs::Log log = parse(bytes);
    EXPECT_EQ(survivors(log), without(20, {6, 7})) << "byte " << at;
    EXPECT_EQ(log.health.damaged_blocks, 1u) << "byte " << at;
    EXPECT_EQ(log.health.skipped_bytes, kBlock_bytes) << "byte " << at;
    EXPECT_EQ(log.health.gaps, 0u) << "30 ms is no gap";
  }
}

TEST(UsdLog, LostBytesCostNoMoreThanTheirBlock) {
  const std::size_t start = usd_header().size() + 3 * kBlock_bytes;
  for (const std::size_t lost : {1u, 5u, 16u, 36u}) {
    const logs::Log log = parse(small_usd().erase(start, lost));
    EXPECT_EQ(survivors(log), without(20, {6, 7})) << lost << " bytes";
  }
  const logs::Log log = parse(small_usd().insert(start, "some bytes that belong nowhere"));
  EXPECT_EQ(survivors(log), without(20, {}));
  EXPECT_EQ(log.health.damaged_blocks, 1u);
}

TEST(UsdLog, EndingAnywhereKeepsTheWholeBlocks) {
  const std::string bytes = small_usd();
  const std::size_t header = usd_header().size();
  for (std::size_t size = header; size < bytes.size(); ++size) {
    const logs::Log log = parse(bytes.substr(0, size));
    EXPECT_EQ(log.samples.size(), 2 * ((size - header) / kBlock_bytes)) << size;
    EXPECT_EQ(log.health.truncated, (size - header) % kBlock_bytes != 0) << size;
  }
  for (std::size_t size = 1; size < header; ++size)
    EXPECT_NE(refusal(bytes.substr(0, size)), "accepted") << size;
}

TEST(UsdLog, ABlockWithoutRecordsIsSound) {
  const logs::Log log = parse(usd_header() + usd_block({}) + usd_block({small_record(10, 0)}));
  EXPECT_EQ(survivors(log), without(1, {}));
  EXPECT_TRUE(logs::is_sound(log.health));
}

TEST(UsdLog, ThePlainChecksumIsNotAccepted) {
  std::string block(1, '\1');
  block += small_record(10000, 0);
  const logs::Log log = parse(usd_header() + block + bytes_of(crc32_of(block)));
  EXPECT_EQ(log.samples.size(), 0u);
  EXPECT_EQ(log.health.damaged_blocks, 1u);
}

TEST(UsdLog, RefusesAHeaderThatItCannotTrust) {
  EXPECT_NE(refusal("").find("the file is empty"), std::string::npos);
  EXPECT_NE(refusal(usd_header({"tick(I)", "x(q)"})).find("is not a known type"), std::string::npos);
  EXPECT_NE(refusal(usd_header({"tick(I)", "tick(I)"})).find("is named twice"), std::string::npos);
  EXPECT_NE(refusal(usd_header({"tick(I)", "a(f)"})).find("no column carries it"), std::string::npos);
  std::string header = small_usd();
  header[12] = 'J';
  EXPECT_NE(refusal(header).find("checksum"), std::string::npos);
}

TEST(UsdLog, RecordsOutOfOrderAreSortedAndImpossibleTimesDropped) {
  const auto at = [](std::uint32_t tick, int x) { return small_record(tick, static_cast<std::int16_t>(x)); };
  const logs::Log log =
      parse(usd_header() + usd_block({at(10000, 0), at(20000, 1), at(15000, 2), at(4000000000u, 3),
                                      at(30000, 4), at(40000, 5), at(40000, 6), at(90000, 7)}));
  EXPECT_EQ(survivors(log), (std::vector<int>{0, 2, 1, 4, 5, 7}));
  EXPECT_EQ(log.health.clock_jumps, 2u) << "4000 s, and another record at 40 ms";
  EXPECT_GE(log.health.repaired.unsorted_rows, 1u);
  EXPECT_EQ(log.health.gaps, 1u);
  EXPECT_DOUBLE_EQ(log.health.longest_gap_s, 0.05);
  EXPECT_TRUE(log.samples.back().restarts);
  EXPECT_FALSE(log.samples[2].restarts);
}

TEST(UsdLog, ItsCompletenessSaysCutWhereTheFileEndsAndDamagedWhereABlockIsWrong) {
  const std::string bytes = small_usd();
  EXPECT_EQ(logs::completeness_of(parse(bytes).health), logs::Completeness::kComplete);
  EXPECT_EQ(logs::lost_share(parse(bytes)), 0);
  const logs::Log cut = parse(bytes.substr(0, bytes.size() - 3));
  EXPECT_EQ(logs::completeness_of(cut.health), logs::Completeness::kCut);
  EXPECT_TRUE(std::isnan(logs::lost_share(cut))) << "nobody knows how much followed";
  std::string wrong = bytes;
  wrong[usd_header().size() + 2] ^= 1;
  const logs::Log damaged = parse(wrong);
  EXPECT_EQ(logs::completeness_of(damaged.health), logs::Completeness::kDamaged);
  EXPECT_DOUBLE_EQ(logs::lost_share(damaged),
                   static_cast<double>(kBlock_bytes) / static_cast<double>(bytes.size()));
}

TEST(UsdLog, TheTickMayWrap) {
  const logs::Log log =
      parse(usd_header() + usd_block({small_record(4294960000u, 0), small_record(2704u, 1)}));
  ASSERT_EQ(log.samples.size(), 2u);
  EXPECT_EQ(log.samples[1].time_us - log.samples[0].time_us, 10000);
}

TEST(EventLog, BothVersionsGiveTheSameSamples) {
  for (const int version : {1, 2}) {
    const logs::Log log = parse(small_events(version));
    ASSERT_EQ(log.samples.size(), 20u) << version;
    EXPECT_EQ(log.samples[4].position_m[0], 4) << version;
    EXPECT_EQ(log.samples[4].time_us, 50000) << version;
    EXPECT_TRUE(logs::is_sound(log.health)) << version;
  }
}

TEST(EventLog, KeepsWhatIsSoundOfADamagedFile) {
  for (const int version : {1, 2}) {
    std::string bytes = small_events(version);
    const std::size_t record = version == 1 ? 30 : 34;
    const std::size_t fifth = bytes.size() - 4 - 16 * record;
    bytes[fifth] = 99;  // no such event
    const logs::Log damaged = parse(bytes);
    EXPECT_EQ(damaged.samples.size(), 19u);
    EXPECT_EQ(damaged.health.damaged_blocks, 1u);
    EXPECT_TRUE(damaged.health.checksum_failed);
    const logs::Log cut = parse(bytes.substr(0, bytes.size() - 50));
    EXPECT_TRUE(cut.health.truncated);
    EXPECT_GE(cut.samples.size(), 17u);
  }
}

TEST(EventLog, ValuesThatAreNotFiniteAreDroppedAndCounted) {
  std::string bytes = small_events(2);
  const float nan = std::nanf("");
  bytes.replace(bytes.size() - 4 - 34 + 10, 4, bytes_of(nan));
  bytes.replace(bytes.size() - 4, 4, bytes_of(crc32_of(bytes.substr(0, bytes.size() - 4))));
  const logs::Log log = parse(bytes);
  EXPECT_EQ(log.samples.size(), 19u);
  EXPECT_EQ(log.health.not_finite, 1u);
  EXPECT_FALSE(log.health.checksum_failed);
}

TEST(CsvLog, IsReadThroughAColumnMap) {
  const logs::Log log = parse(small_csv(), logs::parse_columns(small_columns(), "columns.toml"));
  ASSERT_EQ(log.samples.size(), 20u);
  EXPECT_DOUBLE_EQ(log.samples[4].time_us, 50000);
  EXPECT_DOUBLE_EQ(log.samples[4].position_m[0], 0.004);
  EXPECT_FALSE(log.signals.force);
}

TEST(CsvLog, LinesThatAreNotNumbersAreCounted) {
  const std::string text =
      small_csv(2) + "0.03,2,x,1,1,1,1\n0.04,3,1,1,1,1\n0.05,nan,1,1,1,1,1\n0.06,5,1,1,1,1,1\n0.07,6,1";
  const logs::Log log = parse(text, logs::parse_columns(small_columns(), "columns.toml"));
  EXPECT_EQ(survivors(log), (std::vector<int>{0, 1, 5}));
  EXPECT_EQ(log.health.damaged_lines, 2u);
  EXPECT_EQ(log.health.not_finite, 1u);
  EXPECT_TRUE(log.health.truncated);
}

TEST(CsvLog, OtherSeparatorsEmptyCellsAndColumnsOfTextAreRead) {
  const logs::SignalMap map = logs::parse_columns(small_columns(), "columns.toml");
  const std::string plain = small_csv(3);
  for (const char separator : {';', '\t'}) {
    std::string text = "\xEF\xBB\xBF";
    for (const char c : plain) {
      if (c == '\n')
        text += std::string(1, separator) + (text.find('\n') == std::string::npos ? "mode" : "flying");
      text += c == ',' ? separator : c;
    }
    const logs::Log log = parse(text, map);
    EXPECT_EQ(survivors(log), (std::vector<int>{0, 1, 2})) << separator;
    EXPECT_TRUE(logs::is_sound(log.health));
  }
  const logs::Log log = parse(plain + "0.05,,1,1,1,1,1\n", map);
  EXPECT_EQ(log.health.not_finite, 1u) << "an empty cell of a needed column";
  EXPECT_EQ(log.health.damaged_lines, 0u);
}

TEST(CsvLog, AColumnThatIsNamedButMissingIsRefusedWithASuggestion) {
  std::string columns = small_columns();
  const std::string name = "\"vx\"";
  columns.replace(columns.find(name), name.size(), "\"vxx\"");
  try {
    parse(small_csv(3), logs::parse_columns(columns, "columns.toml"));
    FAIL() << "accepted";
  } catch (const files::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("vxx"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("did you mean"), std::string::npos) << error.what();
  }
}

TEST(Columns, RefuseWhatTheyDoNotKnow) {
  const auto refusal_of = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    try {
      logs::parse_columns(text, "columns.toml");
    } catch (const files::InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(refusal_of(small_columns(), "position_x", "positon_x").find("did you mean \"position_x\"?"),
            std::string::npos);
  EXPECT_NE(refusal_of(small_columns(), "\"mm\"", "\"km\"").find("position_x.unit"), std::string::npos);
  EXPECT_NE(refusal_of(small_columns(), "\"world\"", "\"body\"").find("frame"), std::string::npos);
}

}  // namespace
}  // namespace swarmcert::tests

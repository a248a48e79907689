/// Nothing is lost: rows out of order, repeated or in several blocks, clocks that wrap. Foreign logs are named.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "analysis/logs/read_log.h"
#include "nn/base/input_error.h"

namespace swarmcert::tests {
namespace nothing_lost {
namespace {

constexpr int kRecords = 400;

/// x = 0.3 sin 3 t, y = 0.2 sin 2 t, z = 1 + 0.1 sin 2.5 t at 100 Hz.
double place(int axis, double t) {
  return axis == 0 ? 0.3 * std::sin(3 * t) : axis == 1 ? 0.2 * std::sin(2 * t) : 1 + 0.1 * std::sin(2.5 * t);
}

std::string row(const std::string& clock, double t) {
  std::string text = clock;
  for (int axis = 0; axis < 3; ++axis) text += fmt::format(",{:.7f}", place(axis, t));
  for (int axis = 0; axis < 3; ++axis)
    text += fmt::format(",{:.7f}", (place(axis, t + 1e-4) - place(axis, t - 1e-4)) / 2e-4);
  return text;
}
std::string row(double t) { return row(fmt::format("{:.3f}", t), t); }

std::vector<std::string> rows() {
  std::vector<std::string> all;
  for (int k = 0; k < kRecords; ++k) all.push_back(row(0.01 * k));
  return all;
}

logs::Log read(const std::vector<std::string>& lines, const std::string& header = "time,x,y,z,vx,vy,vz") {
  std::string text = header;
  for (const std::string& line : lines) text += "\n" + line;
  std::istringstream in(text + "\n");
  return logs::parse_log(in, "flight.csv");
}

void expect_whole(const logs::Log& log) {
  ASSERT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords));
  for (std::size_t i = 0; i < log.samples.size(); ++i) {
    const double t = 1e-6 * (log.samples[i].time_us - log.samples[0].time_us);
    EXPECT_NEAR(t, 0.01 * static_cast<double>(i), 1e-6);
    EXPECT_NEAR(log.samples[i].position_m[0], place(0, t), 1e-6) << i;
  }
  EXPECT_EQ(logs::completeness_of(log.health), logs::Completeness::kComplete);
  EXPECT_EQ(logs::lost_share(log), 0);
}

TEST(NothingLost, RowsInAnyOrderAreSortedAndCounted) {
  std::vector<std::string> lines = rows();
  std::swap(lines[100], lines[101]);
  const logs::Log exchanged = read(lines);
  expect_whole(exchanged);
  EXPECT_EQ(exchanged.health.repaired.unsorted_rows, 1u);
  std::shuffle(lines.begin(), lines.end(), std::mt19937(1));
  const logs::Log shuffled = read(lines);
  expect_whole(shuffled);
  EXPECT_GT(shuffled.health.repaired.unsorted_rows, kRecords / 2u);
  lines = rows();
  std::rotate(lines.begin(), lines.begin() + kRecords / 2, lines.end());  // the second file before the first
  expect_whole(read(lines));
}

TEST(NothingLost, RepeatedRowsCountOnce) {
  std::vector<std::string> lines = rows();
  lines.insert(lines.begin() + 200, lines.begin() + 50, lines.begin() + 100);
  const logs::Log log = read(lines);
  expect_whole(log);
  EXPECT_EQ(log.health.repaired.repeated_rows, 50u);
}

TEST(NothingLost, WrapsOfClocksAreCounted) {
  std::vector<std::string> lines;
  for (int k = 0; k < kRecords; ++k)
    lines.push_back(row(fmt::format("{}", (16777216 - 1000 + 10 * k) % 16777216), 0.01 * k));
  const logs::Log log = read(lines);
  expect_whole(log);
  EXPECT_EQ(log.health.repaired.unwrapped_clocks, 1u);
}

TEST(NothingLost, TheEndOfDaylightSavingAndMidnightDoNotEndAFlight) {
  for (const auto& [before, after] :
       {std::pair{"2026-10-25T02:59:", "2026-10-25T02:00:"}, std::pair{"23:59:", "00:00:"}}) {
    std::vector<std::string> lines;
    for (int k = 0; k < kRecords; ++k) {
      const double second = std::fmod(58 + 0.01 * k, 60);
      lines.push_back(row(fmt::format("{}{:06.3f}", k < 200 ? before : after, second), 0.01 * k));
    }
    expect_whole(read(lines));
  }
}

TEST(NothingLost, BlocksOfOtherRatesAreCounted) {
  std::vector<std::string> lines;
  for (int k = 0; k < kRecords; ++k) {
    lines.push_back(row(0.01 * k) + ",");
    if (k % 10 == 0) lines.push_back(fmt::format("{:.3f},,,,,,,3.9", 0.01 * k + 0.001));
  }
  const logs::Log log = read(lines, "time,x,y,z,vx,vy,vz,vbat");
  expect_whole(log);
  EXPECT_GE(log.health.repaired.merged_blocks, 1u);
}

TEST(NothingLost, TwoFlightsOnOneClockAreNotMixed) {
  std::vector<std::string> lines = rows();
  for (int k = 0; k < kRecords; ++k)
    lines.push_back(row(fmt::format("{:.3f}", 0.01 * k + 0.004), 30 + 0.01 * k));
  const logs::Log log = read(lines);
  EXPECT_EQ(log.health.repaired.unsorted_rows, 0u);
  EXPECT_EQ(logs::completeness_of(log.health), logs::Completeness::kDamaged);
  EXPECT_NEAR(logs::lost_share(log), 0.5, 0.01);
}

TEST(NothingLost, ListsInCellsAreColumns) {
  const auto text = [](const char* format, const char* header) {
    std::vector<std::string> lines;
    for (int k = 0; k < kRecords; ++k) {
      const double t = 0.01 * k;
      lines.push_back(fmt::format(fmt::runtime(format), t, place(0, t), place(1, t), place(2, t)));
    }
    return read(lines, header);
  };
  for (const auto& [format, header] : {std::pair{"{:.3f},\"[{:.7f}, {:.7f}, {:.7f}]\",7", "time,pos,battery"},
                                       std::pair{"{:.3f},[{:.7f} {:.7f}  {:.7f}],7", "time,pos,battery"},
                                       std::pair{"{:.3f};({:.7f}, {:.7f}, {:.7f});7", "time;pos;battery"}}) {
    const logs::Log log = text(format, header);
    expect_whole(log);
    EXPECT_EQ(log.channels, (std::vector<std::string>{"time", "pos[0]", "pos[1]", "pos[2]", "battery"}));
  }
}

std::string refusal(const std::string& bytes) {
  std::istringstream in(bytes);
  try {
    logs::parse_log(in, "file");
  } catch (const files::InputError& error) {
    return error.what();
  }
  return "read";
}

TEST(NothingLost, LogsOfOtherProgramsAreNamedWithTheConversionToDo) {
  const std::string bag =
      std::string("#ROSBAG V2.0\n\x45\0\0\0", 17) + "\x0b" + std::string(3, '\0') + "chunk_count=";
  EXPECT_NE(refusal(bag).find("ROS 1 bag; convert it"), std::string::npos) << refusal(bag);
  const std::string blackbox =
      "H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\nH I interval:32\n";
  EXPECT_NE(refusal(blackbox).find("blackbox_decode"), std::string::npos) << refusal(blackbox);
  for (const int magic : {0xFE, 0xFD}) {
    std::string telemetry;
    for (int k = 0; k < 5; ++k) {
      const std::uint64_t time_us = 1'700'000'000'000'000 + 1000 * static_cast<std::uint64_t>(k);
      for (int shift = 56; shift >= 0; shift -= 8) telemetry += static_cast<char>(time_us >> shift & 255);
      telemetry += static_cast<char>(magic);
      telemetry += '\x09';  // bytes of payload
      telemetry += std::string((magic == 0xFE ? 6 : 10) - 2 + 9 + 2, '\0');
    }
    EXPECT_NE(refusal(telemetry).find("MAVLink"), std::string::npos) << refusal(telemetry);
    EXPECT_NE(refusal(telemetry).find("mavlogdump"), std::string::npos);
  }
}

TEST(NothingLost, RatesAndMotorsAloneLetTorquesBeJudged) {
  std::string text = "time,gyro.x,gyro.y,gyro.z,motor.m1,motor.m2,motor.m3,motor.m4,pm.vbat\n";
  for (int k = 0; k < kRecords; ++k)
    text += fmt::format("{:.4f},{:.5f},{:.5f},0.1,{},{},{},{},4.0\n", 0.002 * k, 5 * std::sin(0.02 * k),
                        4 * std::cos(0.03 * k), 36000 + k, 36500 - k, 36000 + k, 36500 - k);
  std::istringstream in(text);
  const logs::Log log = logs::parse_log(in, "flight.csv");
  EXPECT_FALSE(log.signals.force);
  EXPECT_EQ(log.signals.torque, logs::TorqueUse::kDynamic);
  EXPECT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords));
}

TEST(NothingLost, WithoutAnyOtherSignalRatesAreUsedOnlyInAStatedUnit) {
  const auto text = [](const char* header) {
    std::string rows = std::string(header) + ",motor_1,motor_2,motor_3,motor_4\n";
    for (int k = 0; k < kRecords; ++k)
      rows += fmt::format("{:.3f},{:.5f},{:.5f},0.1,40000,40100,40200,40300\n", 0.002 * k,
                          20 * std::sin(0.02 * k), 15 * std::cos(0.03 * k));
    return rows;
  };
  std::istringstream stated(text("time,gyro_x_dps,gyro_y_dps,gyro_z_dps"));
  const logs::Log log = logs::parse_log(stated, "flight.csv");
  EXPECT_EQ(log.signals.torque, logs::TorqueUse::kDynamic);
  EXPECT_NEAR(log.samples[0].rates_rad_s[1], 15 * 3.14159265 / 180, 1e-6);
  EXPECT_NE(refusal(text("time,gyro_x,gyro_y,gyro_z")).find("body rates in rad/s"), std::string::npos)
      << "it is said what the columns could be";
}

TEST(NothingLost, AnAttitudeOfZerosIsSaidToBeInvalid) {
  std::vector<std::string> lines = rows();
  for (std::string& line : lines) line += ",0,0,0,0";
  const logs::Log log = read(lines, "time,x,y,z,vx,vy,vz,qx,qy,qz,qw");
  EXPECT_FALSE(log.signals.attitude);
  const auto said =
      std::find(log.interpretation.begin(), log.interpretation.end(), "not used: qx, qy, qz, qw: only zeros");
  EXPECT_NE(said, log.interpretation.end());
}

}  // namespace
}  // namespace nothing_lost
}  // namespace swarmcert::tests

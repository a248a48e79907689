/// CSV conventions of other programs and countries: separators, decimal commas, dates, comments, downward axes.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

#include "analysis/logs/plausibility.h"
#include "analysis/logs/read_log.h"
#include "nn/base/input_error.h"

namespace swarmcert::tests {
namespace {

logs::Log convention(const std::string& text, const std::string& columns = "") {
  std::istringstream in(text);
  return columns.empty() ? logs::parse_log(in, "flight.csv")
                         : logs::parse_log(in, "flight.csv", logs::parse_columns(columns, "columns.toml"));
}

/// Records of a position and a velocity every 10 ms: time formatted by `clock`, x = 0.25 k.
template <typename Clock>
std::string positions(const Clock& clock, char separator = ',', char point = '.', int count = 60) {
  std::string text;
  for (int k = 0; k < count; ++k) {
    std::string numbers = fmt::format("{:.2f}|0.0|1.5", 0.25 * k);
    std::replace(numbers.begin(), numbers.end(), '.', point);
    std::replace(numbers.begin(), numbers.end(), '|', separator);
    text += clock(k) + separator + numbers + "\n";
  }
  return text;
}
std::string seconds(int k) { return fmt::format("{:.2f}", 0.01 * k); }

void expect_positions(const logs::Log& log, const std::string& what, std::size_t count = 60) {
  ASSERT_EQ(log.samples.size(), count) << what;
  for (std::size_t k = 0; k < count; ++k) {
    EXPECT_NEAR(log.samples[k].position_m[0], 0.25 * static_cast<double>(k), 1e-12) << what;
    EXPECT_NEAR(log.samples[k].position_m[2], 1.5, 1e-12) << what;
    EXPECT_NEAR(log.samples[k].time_us - log.samples[0].time_us, 1e4 * static_cast<double>(k), 1) << what;
  }
  EXPECT_TRUE(logs::is_sound(log.health)) << what;
}

TEST(CsvConventions, CommasAreDecimalPointsWhereAnotherSignSeparates) {
  for (const char separator : {';', '\t'}) {
    const std::string head = fmt::format("t{0}px{0}py{0}pz\n", separator);
    const auto clock = [](int k) {
      std::string text = seconds(k);
      std::replace(text.begin(), text.end(), '.', ',');
      return text;
    };
    expect_positions(convention(head + positions(clock, separator, ',')), std::string(1, separator));
  }
}

TEST(CsvConventions, DatesAndTimesOfTheDayAreClocks) {
  const std::string head = "time,px,py,pz\n";
  // 2026-03-02 10:15:07 UTC is 1772446507 s after 1970-01-01 (date -u -d @1772446507).
  const std::pair<const char*, const char*> forms[] = {
      {"2026-03-02T10:15:{:05.2f}Z", "ISO 8601"},
      {"2026-03-02 10:15:{:05.2f}", "with a blank"},
      {"\"2026/03/02 10:15:{:05.2f}\"", "quoted, with slashes"},
      {"2026-03-02T11:15:{:05.2f}+01:00", "an hour ahead"},
      {"2026-03-02T06:45:{:05.2f}-0330", "behind"}};
  for (const auto& [form, what] : forms) {
    const char* const text = form;
    const logs::Log log =
        convention(head + positions([&](int k) { return fmt::format(fmt::runtime(text), 7 + 0.01 * k); }));
    expect_positions(log, what);
    EXPECT_EQ(log.epoch_s, 1772446507) << what;
  }
  expect_positions(
      convention(head + positions([](int k) { return fmt::format("10:15:{:05.2f}", 7 + 0.01 * k); })),
      "time of the day");
  // 29 February of a leap year: 2000-02-29 is day 11016.
  const logs::Log leap =
      convention(head + positions([](int k) { return fmt::format("2000-02-29T00:00:{:05.2f}", 0.01 * k); }));
  EXPECT_EQ(leap.epoch_s, 11016.0 * 86400);
}

TEST(CsvConventions, ClocksMayNameNanoseconds) {
  expect_positions(convention("timestamp_ns,px,py,pz\n" +
                              positions([](int k) { return fmt::format("{}", 10'000'000 * k); })),
                   "ns");
}

TEST(CsvConventions, CommentsMayStandBeforeTheHeader) {
  const std::string body = positions(seconds);
  expect_positions(convention("# recorded by a logger\n# cf5\nt,px,py,pz\n" + body), "before the header");
  expect_positions(convention("# recorded by a logger\n# t,px,py,pz\n" + body),
                   "the last of them is the header");
  expect_positions(convention("#t,px,py,pz\n" + body), "a header with a sign of a comment");
}

std::string refusal_of_csv(const std::string& text) {
  try {
    convention(text);
  } catch (const files::InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CsvConventions, ATableOfWhichNoLineCanBeReadIsRefusedWithTheFirstOfThem) {
  EXPECT_EQ(refusal_of_csv("t,px,py,pz\nnoon,1,2,3\n1,2,3,oops\n").substr(0, 48),
            "flight.csv: line 2: t = \"noon\": is not a number;");
  EXPECT_EQ(refusal_of_csv("# a\n# t,px,py,pz\n1,2,3\n2,3,4\n").substr(0, 73),
            "flight.csv: line 3: cells: do not match the number of names in the header");
  EXPECT_NE(refusal_of_csv("time,px,py,pz\n2026-13-02T10:15:07,1,2,3\n").find("is not a number"),
            std::string::npos);
  EXPECT_NE(refusal_of_csv(std::string("\x1F\x8B\x08\x00", 4)).find("is compressed; unpack it"),
            std::string::npos);
  EXPECT_NE(refusal_of_csv(std::string("\xFF\xFEt\0,\0", 6)).find("UTF-16; save it as UTF-8"),
            std::string::npos);
}

TEST(CsvConventions, AColumnWithoutAnyNumberIsMissingAndCostsNoRecord) {
  std::string text = "t,px,py,pz,vx,vy,vz\n";
  for (int k = 0; k < 60; ++k) text += fmt::format("{},{},0,nan,nan,nan,nan\n", 0.01 * k, 0.25 * k);
  const logs::Log log = convention(text);
  EXPECT_EQ(log.samples.size(), 60u);
  for (const logs::SignalInfo& info : log.sources) {
    if (info.name == "position") {
      EXPECT_EQ(info.from, "px, py");
    }
    if (info.name == "velocity") {
      EXPECT_EQ(info.source, logs::SignalInfo::Source::kDerived);
    }
  }
}

/// A climb by 1 m with the nose 30 degrees to the left, with z up or z down.
std::string climb(bool down, const std::string& head) {
  std::string text = head;
  const double yaw = 0.5235987755982988, s = down ? -1 : 1;
  for (int k = 0; k < 200; ++k) {
    const double t = 0.01 * k;
    text += fmt::format(
        "{:.2f},{:.6f},{:.6f},{:.6f},1,{:.6f},{:.6f},{:.9f},0,0,{:.9f},0,0.1,{:.6f},0.5,0.5,0.5,0.5,3.8\n", t,
        t, s * 2 * t, s * t * t / 4, s * 2, s * t / 2, std::cos(yaw / 2), s * std::sin(yaw / 2),
        s * (9.80665 + 0.5));
  }
  return text;
}

void expect_climb(const logs::Log& log) {
  ASSERT_EQ(log.samples.size(), 200u);
  for (std::size_t k = 10; k < 190; k += 30) {
    const double t = 0.01 * static_cast<double>(k);
    const logs::Sample& sample = log.samples[k];
    EXPECT_NEAR(sample.position_m[1], 2 * t, 1e-6);
    EXPECT_NEAR(sample.position_m[2], t * t / 4, 1e-6);
    EXPECT_NEAR(sample.velocity_m_s[2], t / 2, 1e-6);
    EXPECT_NEAR(sample.attitude.z, 0.25881904510252074, 1e-8);
  }
}

TEST(CsvConventions, NorthEastDownIsTurnedUpWhereNamesSayIt) {
  const std::string rest = ",q0,q1,q2,q3,ax,ay,az,m1,m2,m3,m4,vbat\n";
  const logs::Log ned = convention(climb(true, "t,north,east,down,vn,ve,vd" + rest));
  expect_climb(ned);
  // The accelerometer's z also points down; y is 0.1 to the right.
  EXPECT_NEAR(ned.samples[100].specific_force_m_s2[2], 9.80665 + 0.5, 1e-5);
  expect_climb(convention(climb(false, "t,east,north,up,ve,vn,vu" + rest)));
}

TEST(CsvConventions, AColumnsTomlTurnsAxesByAMinusInTheUnit) {
  std::string columns = "schema = \"swarmcert/columns/1\"\ntime = {column = \"t\", unit = \"s\"}\n";
  const std::pair<const char*, const char*> lengths[] = {{"x", ""}, {"y", "-"}, {"z", "-"}};
  for (const auto& [axis, sign] : lengths) {
    columns += fmt::format("position_{0} = {{column = \"a{0}\", unit = \"{1}m\"}}\n", axis, sign);
    columns += fmt::format("velocity_{0} = {{column = \"b{0}\", unit = \"{1}m/s\"}}\n", axis, sign);
    columns += fmt::format("attitude_{0} = {{column = \"q{0}\", unit = \"{1}1\"}}\n", axis, sign);
    columns += fmt::format(
        "specific_force_{0} = {{column = \"f{0}\", unit = \"{1}m/s^2\", frame = \"body\"}}\n", axis, sign);
  }
  for (int k = 1; k <= 4; ++k) columns += fmt::format("duty_{0} = {{column = \"m{0}\", unit = \"1\"}}\n", k);
  columns += "battery = {column = \"v\", unit = \"V\"}\n";
  columns += "attitude_w = {column = \"qw\", unit = \"1\"}\n";
  const logs::Log log =
      convention(climb(true, "t,ax,ay,az,bx,by,bz,qw,qx,qy,qz,fx,fy,fz,m1,m2,m3,m4,v\n"), columns);
  expect_climb(log);
  EXPECT_NEAR(log.samples[100].specific_force_m_s2[2], 9.80665 + 0.5, 1e-5);
}

TEST(CsvConventions, AFlightBelowTheGroundPointsDownAndAMissingPositionIsNotDoubted) {
  const auto doubted = [](const logs::Log& log) {
    std::string names;
    for (const logs::Doubt& doubt : logs::doubts_of(log)) names += doubt.words + "\n";
    return names;
  };
  std::string below = "t,px,py,pz,vx,vy,vz\n", none = "t,vx,vy,vz\n";
  for (int k = 0; k < 300; ++k) {
    const double t = 0.01 * k;
    below += fmt::format("{:.2f},0,0,{:.6f},0,0,{:.6f}\n", t, -1.2 * std::sin(t), -1.2 * std::cos(t));
    none += fmt::format("{:.2f},0.5,0,1\n", t);
  }
  EXPECT_GT(convention(below).samples[100].position_m[2], 1) << "read as a flight above the ground";
  EXPECT_EQ(doubted(convention(below)), "");
  EXPECT_EQ(doubted(convention(none)), "");
}

/// Rows of a swing: time, position, quaternion.
std::string swing_rows(const std::function<std::string(int)>& clock, const std::string& separator,
                       const std::string& before = "") {
  std::string rows;
  for (int k = 0; k < 400; ++k) {
    const double t = 0.01 * k, ax = -2.7 * std::sin(3 * t), ay = -0.8 * std::sin(2 * t),
                 up = logs::kGravity_m_s2 - 0.625 * std::sin(2.5 * t);
    const double pitch = std::atan2(ax, up) / 2, roll = std::atan2(-ay, std::hypot(ax, up)) / 2;
    rows += clock(k) + separator + before;
    for (const double value : {0.3 * std::sin(3 * t), 0.2 * std::sin(2 * t), 1 + 0.1 * std::sin(2.5 * t),
                               std::sin(roll) * std::cos(pitch), std::cos(roll) * std::sin(pitch),
                               -std::sin(roll) * std::sin(pitch)})
      rows += fmt::format("{:.6f}", value) + separator;
    rows += fmt::format("{:.6f}\n", std::cos(roll) * std::cos(pitch));
  }
  return rows;
}

void expect_swing(const std::string& text, const char* what) {
  const logs::Log log = convention(text);
  ASSERT_EQ(log.samples.size(), 400u) << what;
  EXPECT_TRUE(log.signals.position && log.signals.attitude) << what;
  EXPECT_NEAR(1e-6 * (log.samples[300].time_us - log.samples[0].time_us), 3, 1e-6) << what;
  EXPECT_NEAR(log.samples[300].position_m[0], 0.3 * std::sin(9.0), 1e-5) << what;
}

/// `ros2 topic echo --csv` writes seconds, nanoseconds and the frame first, and no header; other programs write
/// trajectories without one.
TEST(CsvConventions, WithoutAHeaderTheValuesSayWhatTheColumnsAre) {
  const auto stamp = [](int k) { return fmt::format("{},{}", 1772446507 + k / 100, 10'000'000 * (k % 100)); };
  const auto epoch = [](int k) { return fmt::format("{:.6f}", 1305031102.17 + 0.01 * k); };
  expect_swing(swing_rows(stamp, ",", "map,"), "ros2 topic echo --csv");
  expect_swing(swing_rows(epoch, " "), "a trajectory");
  expect_swing("# by hand\n" + swing_rows(epoch, " "), "a comment that is no header");
  expect_swing("stamp.sec,stamp.nanosec,x,y,z,qx,qy,qz,qw\n" + swing_rows(stamp, ","), "with a header");
}

TEST(CsvConventions, TheUnitInTheNameOfAClockIsBelieved) {
  std::string text = "time (us),px,py,pz\n";
  for (int k = 0; k < 400; ++k) text += fmt::format("{},{:.6f},0,1\n", 250 * k, 0.001 * k);
  const logs::Log log = convention(text);
  EXPECT_NEAR(log.samples.back().time_us - log.samples.front().time_us, 250 * 399, 1e-6);
}

TEST(CsvConventions, SeparatorsWithinQuotesAreNone) {
  expect_swing("\"t (s)\";\"x, m\";\"y, m\";\"z, m\";qx;qy;qz;qw\n" +
                   swing_rows([](int k) { return fmt::format("{:.2f}", 0.01 * k); }, ";"),
               "quoted names with commas");
}

TEST(CsvConventions, PulsesOfSixMotorsAreReadAsMicroseconds) {
  std::string text = "t,px,py,pz,m1,m2,m3,m4,m5,m6\n";
  for (int k = 0; k < 400; ++k)
    text += fmt::format("{0:.2f},{1:.5f},0,1.5,{2},{2},{2},{2},{2},{2}\n", 0.01 * k, 0.2 * std::sin(0.03 * k),
                        1500 + k % 5);
  const logs::Log log = convention(text);
  EXPECT_EQ(log.signals.motor_commands, 6);
  EXPECT_NEAR(log.samples[200].motor_command[5], 0.5, 0.005);
}

}  // namespace
}  // namespace swarmcert::tests

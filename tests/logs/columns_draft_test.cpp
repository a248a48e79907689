/// Drafts of columns.toml for tables with meaningless column names.
#include "analysis/logs/columns_draft.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "analysis/logs/read_log.h"
#include "data.h"
#include "nn/base/input_error.h"
#include "synthetic_header.h"

namespace swarmcert::tests {
namespace {

constexpr double kDegreesPerRadian = 180 / 3.14159265358979323846;

/// A vehicle that oscillates in a room, with its thrust axis along acceleration + g and yaw 0.
struct Flight {
  double x, y, z, vx, vy, vz, roll, pitch;
  explicit Flight(double t) {
    x = 0.3 * std::sin(3 * t), y = 0.2 * std::sin(2 * t), z = 1.4 + 0.3 * std::sin(1.5 * t);
    vx = 0.9 * std::cos(3 * t), vy = 0.4 * std::cos(2 * t), vz = 0.45 * std::cos(1.5 * t);
    const double ax = -2.7 * std::sin(3 * t), ay = -0.8 * std::sin(2 * t);
    const double up = logs::kGravity_m_s2 - 0.675 * std::sin(1.5 * t);
    pitch = std::atan2(ax, up);
    roll = std::atan2(-ay, std::hypot(ax, up));
  }
  std::string quaternion() const {  // x, y, z, w
    const double cr = std::cos(roll / 2), sr = std::sin(roll / 2), cp = std::cos(pitch / 2),
                 sp = std::sin(pitch / 2);
    return fmt::format("{:.6f},{:.6f},{:.6f},{:.6f}", sr * cp, cr * sp, -sr * sp, cr * cp);
  }
};

class ColumnsDraftOfValues : public testing::Test {
 protected:
  ColumnsDraftOfValues()
      : path_((std::filesystem::path(testing::TempDir()) /
               (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".csv"))
                  .string()) {}
  ~ColumnsDraftOfValues() override { std::filesystem::remove(path_); }

  const std::string path_;
};

TEST_F(ColumnsDraftOfValues, NamesEveryColumnThatItsValuesTellAndReadsTheFlight) {
  {
    std::ofstream out(path_);
    out << "c0,c1,c2,c3,c4,c5,c6,c7,c8,c9,c10,c11,c12,c13,c14,c15,c16,c17,c18\n";
    for (int k = 0; k < 800; ++k) {
      const double t = 0.01 * k;
      const Flight f(t);
      out << fmt::format("{},{},{:.1f},{:.1f},{:.1f},{:.4f},{:.4f},{:.4f},{},{},{},{},{},{:.3f},7,{}\n", k,
                         1000 + 10 * k, 1000 * f.x, 1000 * f.y, 1000 * f.z, f.vx, f.vy, f.vz, f.quaternion(),
                         36000 + k, 36500 + k, 35500 + k, 36200 + k, 3.9 - 0.0002 * k, (k * 37) % 11);
    }
  }
  const std::string draft = logs::columns_draft(path_);
  for (const char* const line :
       {"time = { column = \"c1\", unit = \"ms\" }",
        "position_x = { column = \"c2\", unit = \"mm\", frame = \"world\" }",
        "velocity_z = { column = \"c7\", unit = \"m/s\", frame = \"world\" }",
        "attitude_x = { column = \"c8\"", "attitude_w = { column = \"c11\"", "bits against",
        "# FILL IN, if it was logged: duty_1", "# not used: c0 (0 .. 799, median 399)"})
    EXPECT_NE(draft.find(line), std::string::npos) << line << "\n" << draft;
  const logs::Log log = logs::read_log(path_, logs::parse_columns(draft, "columns.toml"));
  ASSERT_GT(log.samples.size(), 700u);
  const logs::Sample& sample = log.samples[400];
  const Flight truth(1e-6 * sample.time_us - 1);  // the clock starts at 1000 ms
  EXPECT_NEAR(sample.position_m[0], truth.x, 2e-3);
  EXPECT_NEAR(sample.velocity_m_s[1], truth.vy, 2e-3);
  EXPECT_NEAR(sample.attitude.rotation()[0][2], std::sin(truth.pitch) * std::cos(truth.roll), 2e-3);
}

TEST_F(ColumnsDraftOfValues, AnglesFollowFromTheLateralAccelerationAndWhatIsMissingIsToBeFilledIn) {
  {
    std::ofstream out(path_);
    out << "c0,c1,c2,c3,c4,c5,c6,c7,c8,c9\n";
    for (int k = 0; k < 800; ++k) {
      const double t = 0.01 * k;
      const Flight f(t);
      out << fmt::format("{:.3f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.3f},{:.3f},{:.3f}\n", t, f.x,
                         f.y, f.z, f.vx, f.vy, f.vz, kDegreesPerRadian * f.roll, -kDegreesPerRadian * f.pitch,
                         0.5 * std::sin(t));
    }
  }
  const std::string draft = logs::columns_draft(path_);
  for (const char* const line :
       {"time = { column = \"c0\", unit = \"s\" }", "roll = { column = \"c7\", unit = \"deg\" }",
        "pitch = { column = \"c8\", unit = \"-deg\" }", "# FILL IN, if it was logged: duty_1"})
    EXPECT_NE(draft.find(line), std::string::npos) << line << "\n" << draft;
}

TEST_F(ColumnsDraftOfValues, ATableWithoutAClockIsRefused) {
  std::ofstream(path_) << "gain,error\n1,2\n1,3\n0.5,7\n2,1\n";
  EXPECT_THROW(logs::columns_draft(path_), files::InputError);
}

/// All numbers of a sample.
std::vector<double> numbers(const logs::Sample& s) {
  std::vector<double> all = {s.time_us, s.battery_V, s.thrust_command_N, s.given_thrust,
                             s.restarts ? 1.0 : 0.0};
  const auto add = [&all](const auto& values) { all.insert(all.end(), values.begin(), values.end()); };
  for (const logs::Vector* const v : {&s.position_m, &s.velocity_m_s, &s.specific_force_m_s2, &s.rates_rad_s,
                                      &s.target_position_m, &s.target_velocity_m_s, &s.torque_command_Nm})
    add(*v);
  add(s.attitude.xyzw());
  add(s.duty);
  add(s.motor_force_N);
  add(s.motor_command);
  return all;
}

void expect_same_samples(const logs::Log& a, const logs::Log& b) {
  ASSERT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    const std::vector<double> x = numbers(a.samples[i]), y = numbers(b.samples[i]);
    for (std::size_t k = 0; k < x.size(); ++k)
      ASSERT_TRUE(x[k] == y[k] || (std::isnan(x[k]) && std::isnan(y[k])))
          << "number " << k << " of sample " << i << ": " << x[k] << ", by the draft " << y[k];
  }
}

/// Reads a table, and again by its draft. Returns false where there is no draft.
bool expect_that_the_draft_says_all(const std::string& path) {
  SCOPED_TRACE(path);
  std::string draft;
  logs::Log log;
  try {
    draft = logs::columns_draft(path);
    log = logs::read_log(path);
  } catch (const files::InputError&) {
    return false;
  }
  const logs::SignalMap map = logs::parse_columns(draft, "draft");
  const logs::Log again = logs::read_log(path, map);
  expect_same_samples(log, again);
  EXPECT_EQ(log.interpretation, again.interpretation);
  EXPECT_EQ(log.sources.size(), again.sources.size());
  for (std::size_t i = 0; i < std::min(log.sources.size(), again.sources.size()); ++i) {
    EXPECT_EQ(log.sources[i].from, again.sources[i].from);
    EXPECT_EQ(log.sources[i].unit, again.sources[i].unit);
    EXPECT_EQ(log.sources[i].runner_up, again.sources[i].runner_up);
  }
  return true;
}

TEST_F(ColumnsDraftOfValues, ByItselfSaysAllThatWasReadUnderRandomNames) {
  int read = 0;
  for (std::uint32_t seed = 1; seed <= 25; ++seed) {
    const SyntheticTable table = synthetic_table(seed);
    SCOPED_TRACE(table.habits);
    std::ofstream(path_) << table.text;
    if (!expect_that_the_draft_says_all(path_)) continue;
    ++read;
    // A stream is read by the columns.toml alone.
    std::istringstream guessed(table.text), stated(table.text);
    expect_same_samples(
        logs::parse_log(guessed, path_),
        logs::parse_log(stated, path_, logs::parse_columns(logs::columns_draft(path_), "draft")));
  }
  EXPECT_GE(read, 23);
}

void expect_drafts_of_recorded_tables(std::size_t every) {
  std::size_t count = 0, read = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data_path("."))) {
    if (!entry.is_regular_file() || count++ % every != 0 || !logs::looks_like_log(entry.path().string()))
      continue;
    read += expect_that_the_draft_says_all(entry.path().string()) ? 1 : 0;
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(read, 5U);
}

TEST(ColumnsDraft, OfRecordedTablesSaysAllThatWasRead) {
  SWARMCERT_NEEDS_DATA();
  expect_drafts_of_recorded_tables(20);
}

TEST(ColumnsDraft, OfAllRecordedTablesSaysAllThatWasRead_slow) {
  SWARMCERT_NEEDS_DATA();
  expect_drafts_of_recorded_tables(1);
}

}  // namespace
}  // namespace swarmcert::tests

/// Drafts of columns.toml for tables with meaningless column names.
#include "analysis/logs/columns_draft.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "analysis/logs/read_log.h"
#include "nn/base/input_error.h"

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

}  // namespace
}  // namespace swarmcert::tests

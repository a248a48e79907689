/// CSV files with the logs of several vehicles: each vehicle's log is what a file of its own would give.
#include "analysis/logs/vehicles_in_file.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "analysis/logs/read_log.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/temp_folder.h"

namespace swarmcert::tests {
namespace {

using Strings = std::vector<std::string>;

constexpr int kRecords = 40;

/// The cells of vehicle `v` at record k, without the time.
std::string motion(int v, int k) { return fmt::format("{},{:.3f},{}", v, 0.1 * v + 0.01 * k, 1 + v); }
double time_s(int v, int k) { return 0.02 * k + 0.003 * v; }

std::string of_one(int v) {
  std::string text = "t,px,py,pz\n";
  for (int k = 0; k < kRecords; ++k) text += fmt::format("{:.3f},{}\n", time_s(v, k), motion(v, k));
  return text;
}

/// One row per vehicle and record, sorted by time, or by vehicle.
std::string by_rows(const std::string& column, const Strings& entries, bool by_vehicle) {
  std::string text = "t," + column + ",px,py,pz\n";
  const int count = static_cast<int>(entries.size());
  for (int i = 0; i < count * kRecords; ++i) {
    const int v = by_vehicle ? i / kRecords : i % count, k = by_vehicle ? i % kRecords : i / count;
    text += fmt::format("{:.3f},{},{}\n", time_s(v, k), entries[static_cast<std::size_t>(v)], motion(v, k));
  }
  return text;
}

/// One row per record with all vehicles; all have the times of vehicle 0.
std::string by_columns(const Strings& prefixes) {
  std::string text = "t";
  for (const std::string& prefix : prefixes)
    for (const char* const name : {"px", "py", "pz"}) text += "," + prefix + name;
  text += "\n";
  for (int k = 0; k < kRecords; ++k) {
    text += fmt::format("{:.3f}", time_s(0, k));
    for (int v = 0; v < static_cast<int>(prefixes.size()); ++v) text += "," + motion(v, k);
    text += "\n";
  }
  return text;
}

void expect_same_motion(const logs::Log& log, const logs::Log& expected) {
  ASSERT_EQ(log.samples.size(), expected.samples.size());
  for (std::size_t k = 0; k < log.samples.size(); ++k)
    EXPECT_EQ(log.samples[k].position_m, expected.samples[k].position_m);
  EXPECT_TRUE(logs::is_sound(log.health));
}

TEST(VehiclesInFile, AColumnNamesTheVehicleOfEachRow) {
  const TempFolder folder;
  const struct {
    std::string column;
    Strings entries, vehicles;
  } cases[] = {{"drone_id", {"3", "7", "12"}, {"vehicle12", "vehicle3", "vehicle7"}},
               {"cf", {"1", "2", "3"}, {"cf1", "cf2", "cf3"}},
               {"name", {"alpha", "bravo", "char#lie"}, {"alpha", "bravo", "char_lie"}}};
  for (const auto& one : cases) {
    for (const bool by_vehicle : {false, true}) {
      SCOPED_TRACE(one.column + (by_vehicle ? ", one after the other" : ", in turn"));
      const std::string path = folder / "all.csv";
      files::write_file(path, by_rows(one.column, one.entries, by_vehicle), true);
      EXPECT_EQ(logs::vehicles_in(path), one.vehicles);
      files::write_file(folder / "own.csv", of_one(1), true);
      const std::string second = one.column == "drone_id" ? "vehicle7" : one.vehicles[1];
      const logs::Log log = logs::read_log(path + "#" + second);
      expect_same_motion(log, logs::read_log(folder / "own.csv"));
      EXPECT_NEAR(log.samples[0].time_us, 1e6 * time_s(1, 0), 1) << "all logs have the clock of the file";
    }
  }
}

TEST(VehiclesInFile, ALargeFileOfSeveralIsNotTakenForThatOfOneVehicle) {
  const TempFolder folder;
  const std::string path = folder / "large.csv";
  files::write_file(path, by_rows("drone_id", {"1", "2"}, false), false);
  std::filesystem::resize_file(path, files::kLargestFile_bytes + 1);
  EXPECT_EQ(logs::vehicles_in(path), (Strings{"vehicle1", "vehicle2"}));
}

TEST(VehiclesInFile, ColumnsBeginWithTheNameOfTheirVehicle) {
  const TempFolder folder;
  for (const std::string separator : {".", "_", "/", ": "}) {
    const std::string path = folder / "all.csv";
    files::write_file(path, by_columns({"cf4" + separator, "cf5" + separator}), true);
    EXPECT_EQ(logs::vehicles_in(path), (Strings{"cf4", "cf5"})) << separator;
    const logs::Log log = logs::read_log(path + "#cf5");
    ASSERT_EQ(log.samples.size(), static_cast<std::size_t>(kRecords));
    EXPECT_NEAR(log.samples[3].position_m[0], 1, 1e-12);
    EXPECT_NEAR(log.samples[3].position_m[1], 0.13, 1e-12);
  }
}

TEST(VehiclesInFile, AFileOfOneVehicleStaysWhole) {
  const TempFolder folder;
  std::string phases = "t,id,px,py,pz\n", constant = phases, motors = "t,px,py,pz",
              steps = "t,name,px,py,pz\n";
  for (int m = 1; m <= 4; ++m) motors += fmt::format(",motor{0}.rpm,motor{0}.current", m);
  motors += "\n";
  for (int k = 0; k < 4 * kRecords; ++k) {
    phases +=
        fmt::format("{:.2f},{},{}\n", 0.01 * k, k / kRecords, motion(0, k));  // one after the other in time
    constant += fmt::format("{:.2f},5,{}\n", 0.01 * k, motion(0, k));
    steps += fmt::format("{:.2f},step{},{}\n", 0.01 * k, k, motion(0, k));
    motors += fmt::format("{:.2f},{},1,2,3,4,5,6,7,8\n", 0.01 * k, motion(0, k));
  }
  for (const std::string& text : {phases, constant, motors, steps, of_one(0)}) {
    files::write_file(folder / "one.csv", text, true);
    EXPECT_EQ(logs::vehicles_in(folder / "one.csv"), Strings{}) << text.substr(0, 60);
    EXPECT_EQ(logs::addresses_in(folder / "one.csv"), Strings{folder / "one.csv"});
    EXPECT_GE(logs::read_log(folder / "one.csv").samples.size(), static_cast<std::size_t>(kRecords));
  }
}

TEST(VehiclesInFile, AFileOfSeveralIsNotReadAsOneVehicle) {
  const TempFolder folder;
  const std::string path = folder / "all.csv";
  files::write_file(path, by_rows("drone_id", {"1", "2"}, false), true);
  try {
    logs::read_log(path);
    FAIL() << "positions of two vehicles in one log";
  } catch (const files::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("all.csv#vehicle1"), std::string::npos) << error.what();
  }
  try {
    logs::read_log(path + "#vehicle9");
    FAIL() << "there is no such vehicle";
  } catch (const files::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("vehicle1, vehicle2"), std::string::npos) << error.what();
  }
}

TEST(VehiclesInFile, AColumnsTomlSelectsAmongColumnsThatBeginWithNames) {
  const TempFolder folder;
  files::write_file(folder / "all.csv", by_columns({"cf4.", "cf5."}), true);
  const logs::SignalMap map = logs::parse_columns(
      "schema = \"swarmcert/columns/1\"\ntime = { column = \"t\", unit = \"s\" }\n"
      "position_x = { column = \"cf5.px\", unit = \"m\" }\nposition_y = { column = \"cf5.py\", unit = \"m\" "
      "}\n"
      "position_z = { column = \"cf5.pz\", unit = \"m\" }\n",
      "columns.toml");
  EXPECT_NEAR(logs::read_log(folder / "all.csv", map).samples[3].position_m[1], 0.13, 1e-12);
}

TEST(VehiclesInFile, LinesKeepTheirNumbers) {
  const TempFolder folder;
  std::string text = by_rows("cf", {"1", "2"}, false);
  const std::string second_to_last = fmt::format("{:.3f},2,", time_s(1, kRecords - 2));
  text.replace(text.find(second_to_last) + second_to_last.size(), 1, "x");
  files::write_file(folder / "all.csv", text, true);
  const std::string table = logs::table_of({folder / "all.csv", "cf2"});
  const auto line_of = [](const std::string& all, const std::string& part) {
    return std::count(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.find(part)), '\n');
  };
  EXPECT_EQ(line_of(table, ",2,x"), line_of(text, ",2,x"));
  EXPECT_EQ(logs::read_log(folder / "all.csv#cf2").health.damaged_lines, 1u);
}

TEST(VehiclesInFile, TheNameOfAFileMayHoldTheSign) {
  const TempFolder folder;
  files::write_file(folder / "run#2.csv", of_one(0), true);
  EXPECT_EQ(logs::address_of(folder / "run#2.csv").file, folder / "run#2.csv");
  EXPECT_EQ(logs::read_log(folder / "run#2.csv").samples.size(), static_cast<std::size_t>(kRecords));
}

}  // namespace
}  // namespace swarmcert::tests

/// Implausible numbers: options, model and gains files, and logs with signals in another unit.
#include "analysis/logs/plausibility.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <map>

#include "analysis/logs/read_log.h"
#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

const std::string& gains() {
  static const std::string path = source_path("controller/gains/composite.toml");
  return path;
}

const std::string& model() {
  static const std::string path = source_path("stability/models/crazyflie-small.toml");
  return path;
}

/// Expects one refusal whose words name the field, the value and what was probably meant.
void expect_refusal(const ScratchFolder& folder, const std::string& command, int code,
                    const std::vector<std::string>& words) {
  const Outcome outcome = run_shell("timeout 20 swarmcert " + command, folder.path());
  EXPECT_EQ(outcome.exit_code, code) << command << "\n" << outcome.output;
  for (const std::string& word : words)
    EXPECT_NE(outcome.output.find(word), std::string::npos) << command << "\n"
                                                            << outcome.output << "\nlacks " << word;
}

TEST(Plausibility, OptionsInAnotherUnitAreRefusedWithTheOneThatWasMeant) {
  const ScratchFolder folder;
  const std::string bound = "bound --gains " + gains() + " --model " + model() + " --rate 0.3 ";
  expect_refusal(folder, bound + "--battery 3700", 2,
                 {"--battery", "3700 V lies outside the battery range", "2.5 .. 4.5 V", "3700 mV is 3.7"});
  expect_refusal(folder, bound + "--battery 42", 2, {"--battery", "42 V lies outside the battery range"});
  expect_refusal(folder, bound + "--uncertain battery=3700:4200", 2,
                 {"--uncertain battery=3700:4200", "3700 mV is 3.7"});
  expect_refusal(folder, bound + "--uncertain battery=3.7:42", 2, {"42 V lies outside"});
  expect_refusal(folder, bound + "--uncertain lag=10:30", 2, {"lag=10:30", "20 ms are 0.02"});
  expect_refusal(folder, bound + "--uncertain delay=0:4", 2, {"delay=0:4", "longer than 1 s"});
  expect_refusal(folder, bound + "--uncertain thrust=90:110", 2, {"thrust=90:110", "90 % are 0.9"});
  expect_refusal(folder, bound + "--uncertain mass=32:36", 2, {"mass=32:36", "mass is in kg"});
  expect_refusal(
      folder,
      "simulate swap --vehicles 2 --duration 1e12 --model " + model() + " --gains " + gains() + " -o out", 2,
      {"--duration", "1e12 s is longer than a day"});
}

TEST(Plausibility, ABatteryWithinTheRangeThatTheModelStatesIsTaken) {
  const ScratchFolder folder;
  std::string two_cells = read_text(model());
  const std::string range = "battery_range_V = [2.5, 4.5]";
  ASSERT_NE(two_cells.find(range), std::string::npos);
  two_cells.replace(two_cells.find(range), range.size(), "battery_range_V = [6, 8.6]");
  write_text(folder / "two.toml", two_cells);
  const std::string bound = "bound --gains " + gains() + " --amplitude 0.01 --model ";
  EXPECT_EQ(run_shell("swarmcert " + bound + "two.toml --battery 7.4", folder.path()).exit_code, 0);
  expect_refusal(folder, bound + "two.toml --battery 3.7", 2, {"two.toml", "6 .. 8.6 V"});
}

/// A simulated flight as CSV with its columns.toml, with columns that can be scaled.
class RecordedCsv {
 public:
  explicit RecordedCsv(const ScratchFolder& folder) : folder_(folder) {
    const Outcome flown =
        run_shell("swarmcert simulate random-walk -q --duration 30 --seed 4 --model " + model() +
                      " --gains " + source_path("controller/gains/crazyflie-small.toml") +
                      " -o flights && swarmcert inspect -q flights/cf1_00 --csv all.csv",
                  folder.path());
    EXPECT_EQ(flown.exit_code, 0) << flown.output;
  }

  /// Writes logs/cf1_00.csv with every value of the columns that start with one of `names` multiplied by `factor`,
  /// and columns.toml with `units`, e.g. {"duty", "PWM"}.
  void write(const std::vector<std::string>& names, double factor,
             const std::map<std::string, std::string>& units = {}, double added = 0) const {
    std::istringstream in(read_text(folder_ / "all.csv"));
    std::string line,
        header =
            "t,px,py,pz,vx,vy,vz,ax,ay,az,qx,qy,qz,qw,f1,f2,f3,f4,u1,u2,u3,u4,vbat,thrust,tx,ty,tz,wx,wy,wz";
    std::string text = header + "\n";
    std::vector<bool> scaled;
    std::istringstream columns(header);
    for (std::string name; std::getline(columns, name, ',');)
      scaled.push_back(std::find(names.begin(), names.end(), name) != names.end());
    std::getline(in, line);
    while (std::getline(in, line)) {
      std::istringstream cells(line);
      std::string cell;
      for (std::size_t k = 0; std::getline(cells, cell, ','); ++k) {
        double value = std::strtod(cell.c_str(), nullptr);
        if (k == 0) value *= 1e-6;  // in seconds
        text += fmt::format("{}{:.17g}", k == 0 ? "" : ",", scaled[k] ? factor * value + added : value);
      }
      text += "\n";
    }
    std::filesystem::create_directories(folder_.path() / "logs");
    write_text(folder_ / "logs/cf1_00.csv", text);
    write_text(folder_ / "columns.toml", columns_toml(units));
  }

 private:
  static std::string columns_toml(const std::map<std::string, std::string>& units) {
    std::string text = "schema = \"swarmcert/columns/1\"\n";
    const auto add = [&](const std::string& group, const std::string& signal, const std::string& column,
                         const std::string& unit) {
      const auto given = units.find(group);
      text += fmt::format("{} = {{ column = \"{}\", unit = \"{}\" }}\n", signal, column,
                          given == units.end() ? unit : given->second);
    };
    add("time", "time", "t", "s");
    for (const char axis : {'x', 'y', 'z'}) {
      add("position", fmt::format("position_{}", axis), fmt::format("p{}", axis), "m");
      add("velocity", fmt::format("velocity_{}", axis), fmt::format("v{}", axis), "m/s");
      add("specific_force", fmt::format("specific_force_{}", axis), fmt::format("a{}", axis), "m/s^2");
      add("rate", fmt::format("rate_{}", axis), fmt::format("w{}", axis), "rad/s");
    }
    for (const char axis : {'x', 'y', 'z', 'w'})
      add("attitude", fmt::format("attitude_{}", axis), fmt::format("q{}", axis), "1");
    for (int motor = 1; motor <= 4; ++motor)
      add("duty", fmt::format("duty_{}", motor), fmt::format("u{}", motor), "1");
    add("battery", "battery", "vbat", "V");
    return text;
  }

  const ScratchFolder& folder_;
};

files::Json inspected(const ScratchFolder& folder) {
  const Outcome outcome = run_shell(
      "swarmcert inspect logs/cf1_00.csv --columns columns.toml --force --json inspect.json", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  return files::read_json(folder / "inspect.json", "swarmcert/inspect/1")["files"][0]["plausibility"];
}

const std::string& compare_logs() {
  static const std::string command =
      "compare " + model() + " logs --columns columns.toml --force --json compare.json";
  return command;
}

TEST(Plausibility, SignalsOfAFlightAreTrustedInTheirOwnUnits) {
  const ScratchFolder folder;
  const RecordedCsv flight(folder);
  flight.write({}, 1);
  EXPECT_EQ(inspected(folder), files::Json::array());
  const Outcome outcome = run_shell("swarmcert " + compare_logs(), folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(outcome.output.find("implausible"), std::string::npos) << outcome.output;
  const files::Json result = files::read_json(folder / "compare.json", "swarmcert/compare/1");
  EXPECT_EQ(result["flights"][0]["plausibility"], files::Json::array());
}

struct WrongUnit {
  const char* name;
  std::vector<std::string> columns;
  double factor;
  std::map<std::string, std::string> units;
  const char* signal;
  std::string words;
  double added = 0;
};

/// inspect reports the unit, and compare rejects the log with the same words instead of giving a residual.
TEST(Plausibility, LogsInAnotherUnitAreRefusedWithTheOneThatWasMeant) {
  const ScratchFolder folder;
  const RecordedCsv flight(folder);
  const std::vector<std::string> force = {"ax", "ay", "az"}, duty = {"u1", "u2", "u3", "u4"};
  const std::vector<WrongUnit> cases = {
      {"g as m/s^2", force, 1 / 9.81, {}, "specific_force", "probably in g, not in m/s^2"},
      {"m/s^2 as g", force, 1, {{"specific_force", "g"}}, "specific_force", "probably in m/s^2, not in g"},
      {"without gravity", {"az"}, 1, {}, "specific_force", "without gravity", -9.81},
      {"z downwards", force, -1, {}, "specific_force", "z axis probably points down"},
      {"duty in percent", duty, 100, {}, "duty", "percent was probably meant"},
      {"duty in counts", duty, 65536, {}, "duty", "unit = \"PWM\""},
      {"shares as counts", duty, 1, {{"duty", "PWM"}}, "duty", "declared as PWM"},
      {"mV as V", {"vbat"}, 1000, {}, "battery", "millivolt declared as volt"},
      {"V as mV", {"vbat"}, 1, {{"battery", "mV"}}, "battery", "volt declared as millivolt"},
      {"mm as m", {"px", "py", "pz"}, 1000, {}, "position", "positions in mm declared as m"},
      {"ms as s", {"t"}, 1000, {}, "time", "milliseconds declared as seconds"},
      {"us as s", {"t"}, 1e6, {}, "time", "a smaller unit was probably meant"},
      {"s as ms", {"t"}, 1, {{"time", "ms"}}, "time", "seconds declared as milliseconds"},
  };
  for (const WrongUnit& wrong : cases) {
    SCOPED_TRACE(wrong.name);
    flight.write(wrong.columns, wrong.factor, wrong.units, wrong.added);
    bool said = false;
    for (const files::Json& doubt : inspected(folder)) {
      if (doubt["signal"] != wrong.signal) continue;
      said = said || (doubt["refused"].get<bool>() &&
                      doubt["words"].get<std::string>().find(wrong.words) != std::string::npos);
    }
    EXPECT_TRUE(said) << inspected(folder).dump(1);
    expect_refusal(folder, compare_logs(), 3, {"cf1_00.csv", wrong.signal, wrong.words});
  }
}

TEST(Plausibility, RatesInDegreesAreSaid) {
  const ScratchFolder folder;
  const RecordedCsv flight(folder);
  flight.write({"wx", "wy", "wz"}, 57.29577951308232);
  const files::Json doubts = inspected(folder);
  ASSERT_EQ(doubts.size(), 1u) << doubts.dump(1);
  EXPECT_EQ(doubts[0]["signal"], "rate");
  EXPECT_NE(doubts[0]["words"].get<std::string>().find("deg/s declared as rad/s"), std::string::npos);
}

TEST(Plausibility, ThrustFarFromTheWeightAndABatteryOutOfRangeAreSaid) {
  const ScratchFolder folder;
  const RecordedCsv flight(folder);
  flight.write({"u1", "u2", "u3", "u4"}, 0.7);
  const Outcome weak = run_shell("swarmcert " + compare_logs(), folder.path());
  EXPECT_NE(weak.output.find("implausible: logs/cf1_00.csv: thrust: the model gives 0."), std::string::npos)
      << weak.output;
  flight.write({"vbat"}, 3);
  const Outcome three_cells = run_shell("swarmcert " + compare_logs(), folder.path());
  EXPECT_NE(three_cells.output.find("lies outside the battery range"), std::string::npos)
      << three_cells.output;
}

TEST(Plausibility, OfManyLogsThatAreWrongAlikeThreeAreNamedAndTheOthersCounted) {
  const ScratchFolder folder;
  const RecordedCsv flight(folder);
  flight.write({"u1", "u2", "u3", "u4"}, 0.7);
  std::string log = read_text(folder / "logs/cf1_00.csv");
  for (const char* run : {"01", "02", "03", "04"}) {
    log += "\n";  // no two files have the same bytes
    write_text(folder / (std::string("logs/cf1_") + run + ".csv"), log);
  }
  const Outcome outcome = run_shell("swarmcert " + compare_logs(), folder.path());
  int named = 0;
  for (std::size_t at = 0; (at = outcome.output.find("implausible: logs/", at)) != std::string::npos; ++at)
    ++named;
  EXPECT_EQ(named, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("implausible: thrust: 2 more like these, all in --json"), std::string::npos)
      << outcome.output;
  const files::Json flights =
      files::parse_json(read_text(folder / "compare.json"), "compare.json")["flights"];
  ASSERT_EQ(flights.size(), 5u);
  for (const files::Json& one : flights) EXPECT_EQ(one["plausibility"].size(), 1u) << one["file"];
}

/// A touchdown in flight: three records of 60 m/s^2.
TEST(Plausibility, AnImpactIsSaidAndCutSoThatItIsNotTheWorstMoment) {
  const ScratchFolder folder;
  const RecordedCsv flight(folder);
  flight.write({}, 1);
  std::istringstream in(read_text(folder / "logs/cf1_00.csv"));
  std::string text;
  int number = 0;
  for (std::string line; std::getline(in, line); ++number) {
    if (number >= 1500 && number < 1503) {
      std::vector<std::string> cells;
      std::istringstream row(line);
      for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
      cells[9] = "60";
      line.clear();
      for (const std::string& cell : cells) line += (line.empty() ? "" : ",") + cell;
    }
    text += line + "\n";
  }
  ASSERT_GT(number, 2000);
  const auto rmse_z = [&] {
    const Outcome outcome = run_shell("swarmcert " + compare_logs(), folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return files::read_json(folder / "compare.json", "swarmcert/compare/1");
  };
  const double sound = rmse_z()["overall"]["rmse"]["z"];
  write_text(folder / "logs/cf1_00.csv", text);
  const files::Json doubts = inspected(folder);
  ASSERT_EQ(doubts.size(), 1u) << doubts.dump(1);
  EXPECT_NE(doubts[0]["words"].get<std::string>().find("an impact"), std::string::npos);
  const files::Json hit = rmse_z();
  EXPECT_GT(hit["flights"][0]["records"]["impact"].get<int>(), 30) << "0.4 s at 100 Hz";
  EXPECT_LT(hit["flights"][0]["records"]["impact"].get<int>(), 60);
  EXPECT_NEAR(hit["overall"]["rmse"]["z"].get<double>(), sound, 0.02 * sound);
}

TEST(Plausibility, RecordedFlightsAreTrustedAndTheirTouchDownsAreSaid) {
  SWARMCERT_NEEDS_DATA();
  const auto doubts = [](const std::string& log) {
    return logs::doubts_of(logs::read_log(data_path("flights/" + log)));
  };
  EXPECT_TRUE(doubts("visible_test/21_swap_ss/cf50_02").empty());
  // cf101 touches the ground at 38.07 s and flies on.
  const std::vector<logs::Doubt> touched = doubts("development/21_randomwalk_sll/cf101_04");
  ASSERT_EQ(touched.size(), 1u);
  EXPECT_FALSE(touched[0].refuses_force);
  EXPECT_NE(touched[0].words.find("at 38."), std::string::npos) << touched[0].words;
}

TEST(Plausibility, ClocksThatCouldNotBeRelatedAreSaidToBeUnknown) {
  const ScratchFolder folder;
  const std::string gains = source_path("controller/gains/crazyflie-small.toml");
  ASSERT_EQ(run_shell("swarmcert simulate hover -q --vehicles 3 --duration 8 --model " + model() +
                          " --gains " + gains + " -o hover",
                      folder.path())
                .exit_code,
            0);
  const Outcome outcome = run_shell("swarmcert compare " + model() + " hover --json r.json", folder.path());
  EXPECT_NE(outcome.output.find("the offset of 2 logs could not be estimated"), std::string::npos)
      << outcome.output;
  const files::Json result = files::read_json(folder / "r.json", "swarmcert/compare/1");
  EXPECT_EQ(result["clocks"],
            (files::Json{{"reference", 1}, {"absolute", 0}, {"estimated", 0}, {"unknown", 2}}));
  EXPECT_EQ(result["flights"][0]["clock"], "reference");
  EXPECT_EQ(result["flights"][1]["clock"], "unknown");
  EXPECT_TRUE(result["flights"][1]["clock_offset_s"].is_null());
}

}  // namespace
}  // namespace swarmcert::tests

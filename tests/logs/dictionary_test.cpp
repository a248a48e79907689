/// The dictionary of signals: every entry of every file.
#include "analysis/logs/dictionary.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>

#include "analysis/logs/column_names.h"
#include "analysis/logs/formats/ros_topic.h"
#include "data.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/text.h"

namespace swarmcert::tests {
namespace {

TEST(Dictionary, EveryFileOfTheFolderIsInTheToolWithItsSource) {
  std::map<std::string, std::string> embedded(logs::dictionary_files().begin(),
                                              logs::dictionary_files().end());
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(source_path("analysis/logs/dictionary"))) {
    const std::string name = file.path().filename().string();
    if (name == "README.md") continue;
    EXPECT_EQ(embedded[name], files::read_file(file.path().string())) << name;
    if (files::ends_with(name, ".toml") && name != "signals.toml") {
      EXPECT_GT(logs::dictionary_table(name).text("source").size(), 20u) << name;
    }
    ++files;
  }
  EXPECT_EQ(files, logs::dictionary_files().size());
}

TEST(Dictionary, SignalsStandInTheOrderInWhichTheProgramNumbersThem) {
  const std::map<std::string, int> numbers = {{"time", logs::kTime},
                                              {"position", logs::kPosition},
                                              {"velocity", logs::kVelocity},
                                              {"specific_force", logs::kForceWorld},
                                              {"specific_force_body", logs::kForceBody},
                                              {"acceleration", logs::kAccelerationWorld},
                                              {"attitude", logs::kAttitude},
                                              {"attitude_packed", logs::kPackedAttitude},
                                              {"rate", logs::kRates},
                                              {"duty", logs::kDuty},
                                              {"battery", logs::kBattery},
                                              {"target_position", logs::kTargetPosition},
                                              {"target_velocity", logs::kTargetVelocity},
                                              {"motor_force", logs::kMotorForce},
                                              {"thrust", logs::kThrust},
                                              {"torque", logs::kTorque},
                                              {"euler", logs::kEuler},
                                              {"requested", logs::kRequested},
                                              {"rotor_speed", logs::kRotorSpeed},
                                              {"motor_command", logs::kMotorCommand},
                                              {"thrust_command", logs::kThrustCommand}};
  std::size_t signals = 0;
  for (const logs::SignalKind& kind : logs::signal_kinds()) {
    ASSERT_EQ(numbers.count(kind.name), 1u) << kind.name;
    EXPECT_EQ(kind.first, numbers.at(kind.name)) << kind.name;
    EXPECT_FALSE(kind.units.empty()) << kind.name;
    std::set<std::string> units;
    for (const logs::Unit& unit : kind.units) EXPECT_TRUE(units.insert(unit.name).second) << unit.name;
    signals += kind.columns.size();
  }
  EXPECT_EQ(logs::signal_kinds().size(), numbers.size());
  EXPECT_EQ(signals, static_cast<std::size_t>(logs::kNumSignals));
}

TEST(Dictionary, EveryRowHasKnownKeysASignalAndAUnitAndNoNameHasTwoMeanings) {
  const std::vector<std::string> keys = {"signal",     "names",     "unit",           "parts",
                                         "sign",       "open",      "found",          "message",
                                         "instead_of", "functions", "first_function", "limits"};
  for (const auto& [file, text] : logs::dictionary_files()) {
    if (!files::ends_with(file, ".toml") || !logs::dictionary_table(file).has("columns")) continue;
    const files::TomlTable table = logs::dictionary_table(file);
    table.allow_only({"source", "found", "frame", "columns", "signs", "vehicles", "log_this"});
    for (const files::TomlTable& row : table.tables("columns")) EXPECT_NO_THROW(row.allow_only(keys)) << file;
  }
  // column_names() refuses signals that do not exist and units that the signal does not have.
  std::map<std::string, std::pair<int, std::string>> meanings;
  for (const logs::NamedColumns& row : logs::column_names()) {
    EXPECT_LE(row.names.size(), 16u);
    for (std::size_t k = 0; k < row.names.size(); ++k) {
      const std::string& name = row.names[k];
      const bool is_verbatim = !row.message.empty() || name.find('[') != std::string::npos;
      EXPECT_TRUE(is_verbatim || logs::plain_name(name) == name) << name;
      const std::pair<int, std::string> meaning = {row.signal + static_cast<int>(k), row.unit};
      const auto [known, is_new] = meanings.emplace(row.program + row.message + " " + name, meaning);
      EXPECT_EQ(known->second, meaning) << row.program << " " << row.message << " " << name;
    }
  }
  EXPECT_GT(meanings.size(), 200u);
}

TEST(Dictionary, ASignNamesAColumnAParameterOrATextAndWhatItMeans) {
  const std::set<std::string> states = {"landed", "armed", "valid"};
  for (const logs::Sign& sign : logs::signs_of_state()) {
    EXPECT_FALSE(sign.message.empty() || sign.column.empty());
    EXPECT_EQ(states.count(sign.means), 1u) << sign.means;
    EXPECT_EQ(sign.of.empty(), sign.means != "valid") << sign.column;
  }
  for (const logs::Sign& sign : logs::signs_of_vehicle()) {
    EXPECT_EQ((sign.column.empty() ? 0 : 1) + (sign.parameter.empty() ? 0 : 1) + (sign.text.empty() ? 0 : 1),
              1);
    EXPECT_LE(sign.least, sign.most);
    EXPECT_FALSE(sign.means.empty());
  }
}

TEST(Dictionary, NoWordSuggestsTwoThings) {
  std::set<std::string> words;
  for (const char* const kind : {"wish", "foreign", "neutral"})
    for (const std::string& word : logs::words_of_kind(kind)) EXPECT_TRUE(words.insert(word).second) << word;
  for (const files::TomlTable& entry : logs::dictionary_table("words.toml").tables("quantity"))
    for (const std::string& word : entry.texts("words")) EXPECT_TRUE(words.insert(word).second) << word;
  std::set<std::string> spellings;
  const files::TomlTable spelled = logs::dictionary_table("words.toml").table("spelled");
  for (const std::string& unit : spelled.keys())
    for (const std::string& spelling : spelled.texts(unit))
      EXPECT_TRUE(spellings.insert(spelling).second) << spelling;
}

TEST(Dictionary, EveryFirmwareSaysHowToLogWhatIsMissing) {
  for (const char* const program : {"crazyflie", "px4", "stated"})
    for (const char* const signal :
         {"attitude", "specific_force", "velocity", "position", "duty", "battery", "rates", "target"})
      EXPECT_FALSE(logs::line_that_logs(program, signal).empty()) << program << " " << signal;
}

TEST(Dictionary, EveryRosMessageHasALayout) {
  const std::string& text = logs::dictionary_text("ros_messages.msg");
  std::size_t messages = 0;
  for (std::size_t at = text.find("\nMSG: "); at != std::string::npos; at = text.find("\nMSG: ", at + 1)) {
    const std::string name = text.substr(at + 6, text.find('\n', at + 1) - at - 6);
    std::string fault;
    EXPECT_NE(logs::ros_layout(name, "", fault), nullptr) << name << ": " << fault;
    ++messages;
  }
  EXPECT_GT(messages, 30u);
}

}  // namespace
}  // namespace swarmcert::tests

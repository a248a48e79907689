/// Names that diagnose gives to recorded flights of which the truth is known. Sources: the collections' own notes on
/// masses and motors; ratio, lag and drag by an independent program, windows of 100 ms.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "analysis/identification/diagnose.h"
#include "data.h"

namespace swarmcert::identification {
namespace {

Diagnosis diagnosis_of(const std::vector<std::string>& flights, double mass_kg) {
  residuals::InputArguments arguments;
  arguments.models = {tests::source_path("stability/models/crazyflie-small.toml")};
  for (const std::string& flight : flights)
    arguments.flights.push_back(tests::data_path("collections/" + flight));
  residuals::Inputs inputs = residuals::read_inputs(arguments);
  inputs.models[0].mass_kg = mass_kg;
  return diagnose(inputs, "small", every_flight(inputs), 2, [](int, int) {});
}

int place_of(const Diagnosis& diagnosis, const std::string& effect) {
  for (std::size_t i = 0; i < diagnosis.ranking.size(); ++i) {
    if (diagnosis.ranking[i].effect == effect) return static_cast<int>(i);
  }
  return -1;
}

/// The ranking in one line each, for messages.
std::string in_words(const Diagnosis& diagnosis) {
  std::string words;
  for (const Missing& missing : diagnosis.ranking) {
    words += missing.effect + " " + std::to_string(missing.finding.rmse_before_N) + " -> " +
             std::to_string(missing.finding.rmse_after_N);
    for (const auto& [name, value] : missing.parameters) words += " " + name + " " + std::to_string(value);
    words += "\n";
  }
  return words;
}

bool has_collection(const std::string& name) {
  return std::filesystem::exists(tests::data_path("collections/" + name));
}

TEST(KnownTruth, WornMotorsAreAThrustRatioAndNoConstantForce) {
  if (!has_collection("nanobench")) GTEST_SKIP() << "no recorded data";
  const Diagnosis diagnosis = diagnosis_of({"nanobench"}, 0.034);
  SCOPED_TRACE(in_words(diagnosis));
  ASSERT_EQ(place_of(diagnosis, "thrust_ratio"), 0);
  const Missing& ratio = diagnosis.ranking[0];
  EXPECT_GT(1 + ratio.parameters.at("ratio"), 0.69);
  EXPECT_LT(1 + ratio.parameters.at("ratio"), 0.76);
  EXPECT_EQ(ratio.equivalence_class, "mass / payload / thrust scale");
  EXPECT_GT(place_of(diagnosis, "drag_rotor"), 0) << "or its rival drag_linear";
  EXPECT_GT(place_of(diagnosis, "motor_lag"), 0)
      << "which trims that differ from flight to flight had hidden";
}

TEST(KnownTruth, StrongerMotorsAreAThrustRatioThenDrag) {
  if (!has_collection("crazyswarm2-tools")) GTEST_SKIP() << "no recorded data";
  struct Case {
    std::vector<std::string> logs;
    double mass_kg;
  };
  for (const Case& c :
       {Case{{"log08", "log09", "log11"}, 0.0333}, {{"log52", "log57", "log63", "log58"}, 0.0375}}) {
    std::vector<std::string> flights;
    for (const std::string& log : c.logs) flights.push_back("crazyswarm2-tools/logs/" + log);
    const Diagnosis diagnosis = diagnosis_of(flights, c.mass_kg);
    SCOPED_TRACE(c.logs[0] + "\n" + in_words(diagnosis));
    ASSERT_GE(diagnosis.ranking.size(), 2u);
    EXPECT_EQ(diagnosis.ranking[0].effect, "thrust_ratio");
    EXPECT_GT(1 + diagnosis.ranking[0].parameters.at("ratio"), 1.38);
    EXPECT_LT(1 + diagnosis.ranking[0].parameters.at("ratio"), 1.62);
    EXPECT_EQ(diagnosis.ranking[1].effect.substr(0, 4), "drag");
  }
}

}  // namespace
}  // namespace swarmcert::identification

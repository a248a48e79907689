/// Effects that diagnose names for recorded flights with known truth. Sources: the collections' own notes on masses
/// and motors; ratio, lag and drag from an independent program with windows of 100 ms.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/ladder.h"
#include "data.h"

namespace swarmcert::identification {
namespace {

residuals::Inputs inputs_of(const std::vector<std::string>& flights, double mass_kg) {
  residuals::InputArguments arguments;
  arguments.models = {tests::source_path("stability/models/crazyflie-small.toml")};
  for (const std::string& flight : flights)
    arguments.flights.push_back(tests::data_path("collections/" + flight));
  residuals::Inputs inputs = residuals::read_inputs(arguments);
  inputs.models[0].mass_kg = mass_kg;
  return inputs;
}

Diagnosis diagnosis_of(const std::vector<std::string>& flights, double mass_kg) {
  const residuals::Inputs inputs = inputs_of(flights, mass_kg);
  return diagnose(inputs, "small", every_flight(inputs), 2, [](int, int) {});
}

int place_of(const Diagnosis& diagnosis, const std::string& effect) {
  for (std::size_t i = 0; i < diagnosis.ranking.size(); ++i) {
    if (diagnosis.ranking[i].effect == effect) return static_cast<int>(i);
  }
  return -1;
}

/// The ranking in one line per entry, for messages.
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
  EXPECT_GT(place_of(diagnosis, "drag_linear"), 0);
  const int lag = place_of(diagnosis, "motor_lag");
  ASSERT_GT(lag, 0) << "which trims that differ from flight to flight had hidden";
  const double tau_s = diagnosis.ranking[static_cast<std::size_t>(lag)].parameters.at("tau_s");
  EXPECT_GT(tau_s, 0.05) << "of the thrust behind the ratio: 70 ms by an independent program";
  EXPECT_LT(tau_s, 0.09);
}

TEST(KnownTruth, StrongerMotorsAreAThrustRatioThenDrag) {
  if (!has_collection("crazyswarm2-tools")) GTEST_SKIP() << "no recorded data";
  struct Case {
    std::vector<std::string> logs;
    double mass_kg;
  };
  for (const Case& c :
       {Case{{"log08", "log09", "log11"}, 0.0333},
        {{"log12", "log13", "log14", "log16", "log17"}, 0.0368},  // 1.41 m high, give or take 2 cm
        {{"log36", "log37", "log38", "log39", "log41", "log42", "log43"}, 0.0375},
        {{"log52", "log57", "log63", "log58"}, 0.0375},
        {{"log71", "log72", "log73", "log74", "log77", "log78", "log79"}, 0.0375},
        {{"log121", "log122", "log123", "log124", "log126", "log127", "log129"}, 0.0375}}) {
    std::vector<std::string> flights;
    for (const std::string& log : c.logs) flights.push_back("crazyswarm2-tools/logs/" + log);
    const Diagnosis diagnosis = diagnosis_of(flights, c.mass_kg);
    SCOPED_TRACE(c.logs[0] + "\n" + in_words(diagnosis));
    ASSERT_GE(diagnosis.ranking.size(), 2u);
    EXPECT_EQ(diagnosis.ranking[0].effect, "thrust_ratio");
    EXPECT_GT(1 + diagnosis.ranking[0].parameters.at("ratio"), 1.38);
    EXPECT_LT(1 + diagnosis.ranking[0].parameters.at("ratio"), 1.62);
    EXPECT_EQ(diagnosis.ranking[1].effect, "drag_linear");
    EXPECT_GT(diagnosis.ranking[1].intervals.at("drag_N_s_m").upper, 0.009)
        << "at 52 to 63 the value is 0.0084";
    EXPECT_LT(diagnosis.ranking[1].parameters.at("drag_N_s_m"), 0.014);
    EXPECT_EQ(place_of(diagnosis, "ceiling"), -1) << "flights that never come away from one show none";
  }
}

TEST(KnownTruth, WhatIsAddedRaisesNoErrorOfFlightsThatNothingSaw_slow) {
  if (!has_collection("crazypad")) GTEST_SKIP() << "no recorded data";
  std::vector<std::vector<std::string>> sets = {{"crazypad/normal_flight"},
                                                {"crazypad/tape_on_propeller_M3"},
                                                {"crazypad/weight_on_string_W2_near_M3"},
                                                {"crazypad"},
                                                {"nanobench"},
                                                {"nanodrone"},
                                                {"crazyswarm2-tools"}};
  // Of the same vehicle, five flights each; log41 flies 0.4 m higher than log36 to log39.
  for (const int first : {12, 36, 43, 49, 121, 133}) {
    sets.emplace_back();
    for (int log = first; log < first + 5; ++log) {
      const std::string name = "crazyswarm2-tools/logs/log" + std::to_string(log);
      if (has_collection(name)) sets.back().push_back(name);
    }
  }
  int judged = 0;
  for (const std::vector<std::string>& set : sets) {
    const Ladder ladder = climb(inputs_of(set, 0.0375), {}, 2, [](int, int) {});
    if (!ladder.too_poor.empty() || !ladder.is_tested) continue;
    SCOPED_TRACE(set[0]);
    double last_N = ladder.rows[0].test_rmse_N;
    for (const stability::LadderRow& row : ladder.rows)
      if (row.accepted) last_N = row.test_rmse_N;
    EXPECT_LE(last_N, 1.01 * ladder.rows[0].test_rmse_N);
    ++judged;
  }
  EXPECT_GE(judged, 7);
}

}  // namespace
}  // namespace swarmcert::identification

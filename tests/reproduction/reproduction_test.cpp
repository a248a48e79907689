#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert {
namespace {

using files::Json;
using tests::Outcome;
using tests::read_text;

class Reproduction : public testing::Test {
 protected:
  Outcome reproduce(const std::string& words) {
    const Outcome outcome = tests::run_shell("swarmcert reproduce " + words, folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << words << "\n" << outcome.output;
    return outcome;
  }
  Json result(const std::string& experiment, const std::string& root = "out") {
    EXPECT_TRUE(std::filesystem::exists(folder_ / (root + "/" + experiment + "/report.html"))) << experiment;
    return files::read_json(folder_ / (root + "/" + experiment + "/result.json"), "swarmcert/reproduce/1");
  }

  tests::ScratchFolder folder_;
};

/// A single test, because the experiments share flights and networks that would otherwise be created repeatedly.
TEST_F(Reproduction, SmallExperimentsShowWhatTheyClaim) {
  // Runs the shards one after the other; the last call merges them.
  EXPECT_NE(reproduce("table -o out --shard 1/2").output.find("Part 1/2 is done"), std::string::npos);
  EXPECT_NE(reproduce("table -o out --shard 2/2").output.find("Part 2/2 is done"), std::string::npos);
  EXPECT_NE(reproduce("table -o out").output.find("Next: swarmcert reproduce table -o out-full --full"),
            std::string::npos);
  const Json table = result("table");
  EXPECT_TRUE(table["complete"].get<bool>());
  ASSERT_EQ(table["columns"].size(), 2u);
  EXPECT_TRUE(table["columns"][0]["knobs"].empty());
  EXPECT_FALSE(table["columns"][1]["knobs"].empty());
  EXPECT_LT(table["columns"][1]["baseline_farthest_from_paper"].get<double>(), 0.15);
  for (const Json& column : table["columns"]) {
    EXPECT_EQ(column["max_z"].size(), 16u);
    EXPECT_EQ(column["flights"].size(), 16u * 2);
    EXPECT_GT(column["least_improvement_trained_with_3_or_4"].get<double>(), 2) << column["truth"];
    EXPECT_EQ(column["least_improvement_by_training_seed"].size(), 1u);
    EXPECT_GT(column["improvement_trained_with_3_at_5"].get<double>(), 2) << column["truth"];
  }

  reproduce("claims -o out");  // with the networks of the table
  const Json claims = result("claims");
  ASSERT_EQ(claims["conditions"].size(), 4u);
  for (const Json& condition : claims["conditions"]) {
    EXPECT_EQ(condition["flights"].size(), 16u * 2);
    EXPECT_EQ(condition["two_harms_four"], condition["improvement_trained_with_2_at_4"].get<double>() < 1);
    EXPECT_EQ(condition["saturates"], condition["saturated_share"].get<double>() > 0);
  }
  for (const int full : {0, 2}) {  // an emptier battery gives less thrust
    EXPECT_LT(claims["conditions"][full]["saturated_share"].get<double>(),
              claims["conditions"][full + 1]["saturated_share"].get<double>());
  }

  reproduce("curriculum -o out");
  const Json curriculum = result("curriculum");
  ASSERT_EQ(curriculum["stages"].size(), 4u);
  for (const Json& stage : curriculum["stages"]) {
    EXPECT_TRUE(stage["gamma_proved"].get<bool>());
    EXPECT_LT(stage["test_rmse_gf"].get<double>(), 0.7 * stage["test_rmse_of_nothing_gf"].get<double>());
  }
  EXPECT_TRUE(curriculum["least_distance_falls"].get<bool>());
  ASSERT_GT(curriculum["labels"].size(), 3u);
  EXPECT_LT(curriculum["labels_rms_difference_gf"].get<double>(), 0.5);

  reproduce("data -o out");
  EXPECT_EQ(result("data")["curve"].size(), 6u);
  for (const std::string figure : {"intro", "swaps", "heatmap", "validation"}) reproduce(figure + " -o out");
  EXPECT_EQ(result("heatmap")["maps"].size(), 6u);
  EXPECT_GT(result("validation")["vehicles"][0]["correlation"].get<double>(), 0.8);
  reproduce("superposition -o out");
  for (const Json& row : result("superposition")["rows"]) {
    EXPECT_LE(row["interval_gf"][0].get<double>(), row["defect_gf"].get<double>());
    EXPECT_GE(row["interval_gf"][1].get<double>(), row["defect_gf"].get<double>());
  }
  reproduce("lipschitz -o out");
  const Json curve = result("lipschitz")["curve"];
  ASSERT_EQ(curve.size(), 2u);
  EXPECT_LT(curve[0]["bound_gf_per_unit"].get<double>(), curve[1]["bound_gf_per_unit"].get<double>());

  reproduce("symmetry -o out");
  const Json symmetry = result("symmetry");
  ASSERT_EQ(symmetry["by_data"].size(), 4u);
  ASSERT_EQ(symmetry["by_bound"].size(), 8u);
  for (const Json& row : symmetry["by_bound"]) {
    if (row["limited"] == "joint bound") {
      EXPECT_LE(row["bound_gf_per_unit"][0].get<double>(), row["limit"].get<double>()) << row;
    }
  }

  reproduce("layers -o out");
  const Json layers = result("layers");
  ASSERT_EQ(layers["curves"].size(), 10u);
  for (const Json& row : layers["curves"]) {
    EXPECT_LT(row["test_rmse_gf"][0].get<double>(), 2) << row;
    if (row["limited"] != "joint bound") continue;
    EXPECT_LE(row["bound_gf_per_unit"][0].get<double>(), row["limit"].get<double>()) << row;
    EXPECT_GE(row["bound_gf_per_unit"][0].get<double>(), 0.5 * row["limit"].get<double>()) << row;
  }
  ASSERT_EQ(layers["at_equal_bounds"].size(), 2u);
  for (const Json& row : layers["at_equal_bounds"]) {
    for (const Json& errors : row["errors"]) {
      if (errors["method"] == row["preferred_by_selecting_flights"]) continue;
      const auto preferred = std::find_if(row["errors"].begin(), row["errors"].end(), [&](const Json& other) {
        return other["method"] == row["preferred_by_selecting_flights"];
      });
      ASSERT_NE(preferred, row["errors"].end()) << row;
      EXPECT_LE((*preferred)["select_rmse_gf"], errors["select_rmse_gf"]) << row;
    }
  }

  // Regenerated elsewhere, the bytes are the same.
  reproduce("intro -o again -j 1");
  EXPECT_EQ(read_text(folder_ / "out/small/flights-0/stage1/network/phi_small.safetensors"),
            read_text(folder_ / "again/small/flights-0/stage1/network/phi_small.safetensors"));
  EXPECT_EQ(result("intro")["controllers"], result("intro", "again")["controllers"]);
}

TEST_F(Reproduction, RecordedFlightsAreLearnedBesideThePublishedNetworks) {
  SWARMCERT_NEEDS_DATA();
  reproduce("real-flights -o out --recorded '" + tests::data_path("") + "'");
  const Json found = result("real-flights");
  EXPECT_TRUE(found["gamma_proved"].get<bool>());
  EXPECT_EQ(found["compositions"].size(), 2u);  // alone, and with another small vehicle
  EXPECT_TRUE(found["published_networks_saw_test_flights"].get<bool>());
  EXPECT_LT(found["having_seen_test_flights"]["mean_rms_gf"].get<double>(),
            found["having_seen_test_flights"]["published_mean_rms_gf"].get<double>());
  ASSERT_FALSE(found["flights"].empty());
  for (const Json& flight : found["flights"])
    EXPECT_TRUE(flight["nearest_mean_gf"].is_number()) << "one neighbour at most: " << flight;
  ASSERT_EQ(found["bounds"].size(), 2u);  // a small neighbour, and the ground
  for (const Json& bound : found["bounds"]) EXPECT_LE(bound["upper"].get<double>(), 373) << bound;
  const Json& ladder = found["physics_first"];
  EXPECT_LT(ladder.back()["rms_gf"].get<double>(), ladder.front()["rms_gf"].get<double>());
  const Json& path = found["physics_then_network"];
  EXPECT_EQ(path["compositions"].size(), 2u);
  EXPECT_FALSE(path["left_out"].empty());
  EXPECT_LT(path["bound"].get<double>(), path["published_bound"].get<double>());
  for (const Json& row : path["silent"])
    EXPECT_GT(row["rms_gf"].get<double>(), row["physics_rms_gf"].get<double>()) << row;
}

TEST_F(Reproduction, RefusesUnknownExperimentsAndShards) {
  const auto exit_code = [&](const std::string& words) {
    return tests::run_shell("swarmcert reproduce " + words + " -o out", folder_.path()).exit_code;
  };
  EXPECT_EQ(exit_code("tabel"), 2);
  EXPECT_EQ(exit_code("table --shard 3/2"), 2);
  EXPECT_EQ(exit_code("table --shard 1"), 2);
  EXPECT_EQ(exit_code("real-flights --recorded nowhere"), 3);
  EXPECT_EQ(exit_code("superposition --recorded nowhere"), 3);
  EXPECT_EQ(exit_code("intro --seed -1"), 2);
}

}  // namespace
}  // namespace swarmcert

#include "lipschitz/upper/comparison.h"

#include "data.h"
#include "lipschitz/networks.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::Network;

Network published(const std::string& name) {
  return tests::plain(files::load_weights(tests::data_path("weights/zip_f32/" + name)));
}

TEST(Comparison, PublishedNetworksHaveTheReferencesBounds) {
  SWARMCERT_NEEDS_DATA();
  struct Row {
    const char* name;
    double combettes_pesquet, eclipse_fast, floor;
  };
  // From an independent implementation: Combettes-Pesquet with four digits, and a lower bound for the floor.
  const std::vector<Row> rows = {{"phi_L.pth", 41.1968, 47.66665891, 23.73870},
                                 {"phi_G.pth", 28.5169, 26.31880352, 20.46756},
                                 {"rho_L.pth", 24.7570, 24.52722213, 19.79465},
                                 {"rho_S.pth", 24.8484, 24.47766923, 16.75284}};
  for (const Row& row : rows) {
    SCOPED_TRACE(row.name);
    const std::vector<check::Matrix> stages = check::stages(published(row.name), "network");
    const auto combettes = combettes_pesquet(stages);
    ASSERT_TRUE(combettes);
    EXPECT_NEAR(combettes->value(), row.combettes_pesquet, 1e-4 * row.combettes_pesquet);
    const auto fast = eclipse_fast(stages);
    ASSERT_TRUE(fast);
    EXPECT_NEAR(fast->upper.value(), row.eclipse_fast, 1e-6 * row.eclipse_fast);
    EXPECT_GE(pattern_floor(stages).slope.value(), 0.999 * row.floor);
  }
}

TEST(Comparison, FloorIsBelowTheSdpWhichIsBelowTheOthers) {
  std::mt19937 generator(3);
  for (int round = 0; round < 10; ++round) {
    const Network network = tests::plain(tests::random_network({4, 7, 6, 2}, generator));
    const std::vector<check::Matrix> stages = check::stages(network, "network");
    const double sdp = tests::proved(sdp_bound(stages));
    const double floor = pattern_floor(stages).slope.value();
    EXPECT_LE(floor, sdp * (1 + 1e-7));
    EXPECT_GE(floor, tests::sampled_slope(*network.plain, generator, 300) * (1 - 1e-9));
    EXPECT_LE(sdp, eclipse_fast(stages)->upper.value() * (1 + 1e-7));
    EXPECT_GE(combettes_pesquet(stages)->value(), floor * (1 - 1e-9));
  }
}

TEST(Comparison, AffineNetworksHaveNothingToLose) {
  const Network network = tests::plain(tests::weights({tests::layer(1, 2, {3, 4})}));
  const Comparison comparison = compare(network, "network", "all", {});
  EXPECT_NEAR(comparison.combettes_pesquet->value(), 5, 1e-9);
  EXPECT_NEAR(comparison.eclipse_fast->upper.value(), 5, 1e-9);
  EXPECT_NEAR(comparison.floor.slope.value(), 5, 1e-9);
  ASSERT_EQ(comparison.stages.size(), 1u);
  EXPECT_NEAR(comparison.stages[0].loss(), 1, 1e-9);
}

TEST(Comparison, GainsAlongTheSteepestPatternMultiplyToItsSlope) {
  std::mt19937 generator(4);
  const Network network = tests::deep_set(tests::random_network({6, 7, 4}, generator),
                                          tests::random_network({4, 6, 1}, generator));
  const Comparison comparison = compare(network, "set:default:default", "all", {});
  double product = 1;
  for (const double gain : comparison.floor.gains) product *= gain;
  for (const double gain : comparison.floor.relu_gains) product *= gain;
  EXPECT_NEAR(product, comparison.floor.slope.value(), 1e-9 * product);
  ASSERT_EQ(comparison.stages.size(), 3u);
  EXPECT_EQ(comparison.stages[0].name, "fc1 of phi");
  EXPECT_EQ(comparison.stages[1].name, "fc2 of phi with fc1 of rho");
  EXPECT_EQ(comparison.stages[2].name, "fc2 of rho");
  for (const StageLoss& stage : comparison.stages) EXPECT_GE(stage.loss(), 1 - 1e-9) << stage.name;
}

}  // namespace
}  // namespace swarmcert::lipschitz

/// Slopes far from the origin: networks that are steep only where no kink of the first layer is near.
#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/lower/linear_region.h"
#include "lipschitz/lower/search_network.h"
#include "lipschitz/lower/slope_search.h"
#include "lipschitz/networks.h"
#include "nn/base/random.h"

namespace swarmcert::lipschitz {
namespace {

using files::Random;
using tests::slope_of;

files::Weights network_with_biases(const std::vector<int>& sizes, Random& random) {
  const double bias = random.log_uniform(0.1, 10);
  std::vector<files::Layer> layers;
  for (std::size_t k = 1; k < sizes.size(); ++k) {
    files::Layer layer{"fc", sizes[k], sizes[k - 1], {}, {}};
    const double size = 1.4 / std::sqrt(layer.inputs);
    for (int i = 0; i < layer.inputs * layer.outputs; ++i) layer.weights.push_back(size * random.bell());
    for (int i = 0; i < layer.outputs; ++i) layer.biases.push_back(bias * random.bell());
    layers.push_back(std::move(layer));
  }
  files::Weights weights = tests::weights(std::move(layers));
  weights.precision = files::Precision::kFloat64;
  return weights;
}

/// Returns a random network with 1 to 4 inputs, 1 to 3 hidden layers of 2 to 8 neurons and 1 to 3 outputs; biases have
/// magnitudes of 0.1 to 10.
files::Weights small_network(std::uint64_t seed) {
  Random random(7919 * seed + 13);
  std::vector<int> sizes = {1 + static_cast<int>(random.below(4))};
  const auto hidden = 1 + random.below(3);
  for (std::uint64_t k = 0; k < hidden; ++k) sizes.push_back(2 + static_cast<int>(random.below(7)));
  sizes.push_back(1 + static_cast<int>(random.below(3)));
  return network_with_biases(sizes, random);
}

/// Returns the largest slope at random points in random directions, at distances from 0.1 to 1000.
double plainly_sampled(const files::Weights& weights, int samples, std::uint64_t seed) {
  const SearchNetwork network = search_network(slope_of(weights), {std::nullopt}, {});
  Random random(seed);
  double steepest = 0;
  for (int s = 0; s < samples; ++s) {
    Eigen::VectorXd x(weights.inputs());
    for (double& coordinate : x) coordinate = random.bell();
    x *= random.log_uniform(0.1, 1000) / x.norm();
    const Eigen::VectorXd z = (x - network.centre).cwiseQuotient(network.scale);
    steepest = std::max(steepest, local_slope(network, z).slope);
  }
  return steepest;
}

/// Returns for how many of the networks 1 .. `count` plain samples beat the search by more than 2 %.
int beaten(int count, int samples) {
  int result = 0;
  for (int i = 1; i <= count; ++i) {
    const files::Weights network = small_network(static_cast<std::uint64_t>(i));
    const double found = search_slope(slope_of(network)).slope.value();
    const double sampled = plainly_sampled(network, samples, static_cast<std::uint64_t>(i));
    if (sampled <= 1.02 * found) continue;
    ++result;
    std::printf("network %d: searched %.4f, sampled %.4f\n", i, found, sampled);
  }
  return result;
}

TEST(FarSlopes, FewSmallNetworksAreBeatenByPlainSamples) {
  // If searches start near the kinks of the first layer only, samples beat all of these by more than 15 %, network 178
  // by a factor of 9.
  int found = 0;
  for (const std::uint64_t i : {41, 48, 106, 147, 166, 178, 227}) {
    const files::Weights network = small_network(i);
    found += plainly_sampled(network, 5000, i) <= 1.02 * search_slope(slope_of(network)).slope.value();
  }
  EXPECT_EQ(found, 7);
}

TEST(FarSlopes, LessThanOneInAHundredSmallNetworksIsBeatenByPlainSamples_slow) {
  constexpr int kNetworks = 600;
  EXPECT_LT(beaten(kNetworks, 100000), kNetworks / 100);
}

/// Returns the number of boxes of a tree: its leaves and those that were halved.
int boxes_of(const std::string& tree) {
  int boxes = 0;
  std::istringstream words(tree);
  for (std::string word; words >> word;) boxes += word[0] == 's' || word[0] == 't' ? 1 : 0;
  return boxes;
}

TEST(FarSlopes, GlobalBranchAndBoundThatStallsSaysSoAfterFewBoxes) {
  // Without this stop, halving s down to the smallest number takes 1,500 boxes or more.
  int stalls = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    const files::Network network = tests::plain(network_with_biases({2, 3, 6, 2, 1}, random));
    CertifyOptions options;
    options.method = UpperMethod::kBranch;
    options.branch.nodes = 5000;
    options.lower.rounds = 2;
    const Certification found = certify(network, options);
    const CertifiedBound& bound = found.bounds.front();
    EXPECT_NE(bound.branch_stop, BranchStop::kNothingRun) << "seed " << seed;
    EXPECT_EQ(summary(network, bound).status, "finished") << "seed " << seed;
    if (bound.branch_stop != BranchStop::kNothingToHalve) continue;
    ++stalls;
    EXPECT_LT(boxes_of(bound.local->tree.tree), 1000) << "seed " << seed;
    EXPECT_LE(bound.upper.value(), bound.sdp.optimum.value() * (1 + 1e-6)) << "seed " << seed;
    const check::CheckResult verdict = check::check(certificate(network, found), network);
    EXPECT_TRUE(verdict.accepted) << verdict.reason;
  }
  EXPECT_GT(stalls, 0);
}

// f(x) = 7.27 relu(relu(x1) - 1000) + relu(relu(x2 + 0.5) + relu(0.5 - x2) / 2): slope 1 around the origin.
TEST(FarSlopes, ASlopeThatBeginsFarOutIsFound) {
  const files::Weights network = tests::weights({{"fc", 3, 2, {1, 0, 0, 1, 0, -1}, {0, 0.5, 0.5}},
                                                 {"fc", 2, 3, {1, 0, 0, 0, 1, 0.5}, {-1000, 0}},
                                                 {"fc", 1, 2, {7.27, 1}, {0}}});
  EXPECT_GT(search_slope(slope_of(network)).slope.value(), 7.27);
}

}  // namespace
}  // namespace swarmcert::lipschitz

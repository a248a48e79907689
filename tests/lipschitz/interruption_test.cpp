/// Certifications whose searches are cut short: their bounds are proved and marked as interrupted.
#include <gtest/gtest.h>

#include <atomic>

#include "lipschitz/base/stop.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/networks.h"
#include "lipschitz/upper/eclipse_fast.h"

namespace swarmcert::lipschitz {
namespace {

using tests::random_network;

files::Network network_of(const std::vector<int>& sizes) {
  std::mt19937 generator(4);
  return tests::plain(random_network(sizes, generator));
}

files::Network small_set() {
  std::mt19937 generator(4);
  files::Weights phi = random_network({6, 12, 12, 5}, generator);
  return tests::deep_set(std::move(phi), random_network({5, 12, 1}, generator));
}

CertifyOptions few_rounds() {
  CertifyOptions options;
  options.lower.rounds = 1;
  return options;
}

void expect_accepted(const files::Network& network, const Certification& found) {
  const check::CheckResult verdict = check::check(certificate(network, found), network);
  EXPECT_TRUE(verdict.accepted) << verdict.reason;
}

TEST(Interruption, LeavesALayerWiseBoundOfEveryFunction) {
  const std::atomic<bool> cancelled{true};
  for (const files::Network& network : {network_of({4, 20, 20, 20, 2}), small_set()}) {
    CertifyOptions options = few_rounds();
    options.cancelled = &cancelled;
    const Certification found = certify(network, options);
    for (const CertifiedBound& bound : found.bounds) {
      EXPECT_EQ(bound.method, UpperMethod::kEclipseFast) << bound.function;
      EXPECT_LT(bound.upper.value(), bound.product.value()) << bound.function;
      EXPECT_TRUE(bound.is_interrupted()) << bound.function;
      EXPECT_EQ(summary(network, bound).status, "interrupted");
      EXPECT_EQ(summary(network, bound).upper_method, "eclipse_fast");
    }
    EXPECT_TRUE(is_interrupted(found));
    expect_accepted(network, found);
  }
}

TEST(Interruption, TheTimeLimitStopsTheSemidefiniteProgramAndTheSearch) {
  const files::Network network = network_of({6, 60, 60, 60, 1});
  CertifyOptions options;
  options.lower.rounds = 1000000;
  options.seconds = 1e-3;  // less than the first iteration or the first round needs
  const Certification found = certify(network, options);
  const CertifiedBound& bound = found.bounds.front();
  EXPECT_EQ(bound.sdp.stop, LipSdpStop::kTimeLimit);
  EXPECT_TRUE(bound.lower.interrupted);
  EXPECT_EQ(bound.method, UpperMethod::kEclipseFast);
  expect_accepted(network, found);
}

TEST(Interruption, FinishedSearchesSaySo) {
  const files::Network network = network_of({4, 10, 10, 2});
  const Certification found = certify(network, few_rounds());
  EXPECT_EQ(found.bounds.front().method, UpperMethod::kSdp);
  EXPECT_EQ(summary(network, found.bounds.front()).status, "finished");
  expect_accepted(network, found);
}

TEST(Interruption, BranchAndBoundThatIsCutShortSaysSoAndIsProved) {
  const files::Network network = network_of({3, 30, 30, 30, 1});
  CertifyOptions options = few_rounds();
  options.method = UpperMethod::kBranch;
  options.branch.nodes = 1000000;
  options.branch.tolerance = 0;
  options.seconds = 0.05;
  options.domain["network"] = {{-1, -1, -1}, {1, 1, 1}};
  const Certification found = certify(network, options);
  EXPECT_EQ(found.bounds.front().branch_stop, BranchStop::kTimeLimit);
  EXPECT_TRUE(found.bounds.front().is_interrupted());
  expect_accepted(network, found);
}

TEST(Interruption, ACutRoundOfTheSearchCountsForNothing) {
  const files::Network network = network_of({4, 12, 12, 3});
  const SlopeFunction f{{&*network.plain, nullptr}, {}, nullptr};
  std::atomic<bool> cancelled{false};
  SlopeSearchOptions options;
  options.rounds = 1000;
  options.cancelled = &cancelled;
  options.progress = [&](int done, Estimate) { cancelled = done == 3; };
  const SlopeWitness cut = search_slope(f, options);
  SlopeSearchOptions three;
  three.rounds = 3;
  const SlopeWitness whole = search_slope(f, three);
  EXPECT_TRUE(cut.interrupted);
  EXPECT_FALSE(whole.interrupted);
  EXPECT_EQ(cut.x, whole.x);
  EXPECT_EQ(cut.slope, whole.slope);
}

TEST(EclipseFast, LiesBetweenTheProgramAndTheProductAtAnyDepth) {
  for (const std::vector<int>& sizes :
       {std::vector<int>{2, 3, 1}, {5, 20, 8}, {30, 6, 6, 4}, {3, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 1}}) {
    const files::Network network = network_of(sizes);
    const std::vector<check::Matrix> stages = check::stages(network, "network");
    const std::optional<UpperProof> proof = eclipse_fast(stages);
    ASSERT_TRUE(proof.has_value()) << sizes.size() << " layers";
    double product = 1;
    for (const files::Layer& layer : network.plain->layers)
      product *= spectral_norm(layer).norm.upper.value();
    EXPECT_LE(proof->upper.value(), product * (1 + 1e-6));
    EXPECT_GE(proof->upper.value(), tests::proved(sdp_bound(stages)) * (1 - 1e-6));
  }
}

TEST(EclipseFast, DeadNeuronsAndHugeWeightsStillGetAProof) {
  files::Network network = network_of({3, 8, 8, 2});
  for (int j = 0; j < 3; ++j) network.plain->layers[0].weights[static_cast<std::size_t>(j)] = 0;  // no input
  for (int i = 0; i < 2; ++i)
    network.plain->layers[2].weights[static_cast<std::size_t>(8 * i)] = 0;  // no effect
  EXPECT_TRUE(eclipse_fast(check::stages(network, "network")).has_value());
  for (double& weight : network.plain->layers[1].weights) weight *= 0x1p120;
  EXPECT_TRUE(eclipse_fast(check::stages(network, "network")).has_value());
  network = network_of({3, 8, 8, 2});
  for (double& weight : network.plain->layers[0].weights) weight = 0;  // constant
  const std::optional<UpperProof> constant = eclipse_fast(check::stages(network, "network"));
  ASSERT_TRUE(constant.has_value());
  EXPECT_LT(constant->upper.value(), 1e-100);
}

TEST(TimeShares, AreEqualPartsOfWhatIsLeft) {
  const Stop whole(nullptr, 1e6);
  TimeShares shares(whole, 4, 2);
  EXPECT_NEAR(shares.next().seconds_left(), 5e5, 1e3);  // half of the time: four tasks on two threads
  EXPECT_NEAR(shares.next().seconds_left(), 1e6 * 2 / 3, 1e3);
  EXPECT_NEAR(shares.next().seconds_left(), 1e6, 1e3);
  EXPECT_NEAR(shares.next().seconds_left(), 1e6, 1e3);
  EXPECT_FALSE(TimeShares(Stop(), 4, 2).next().has_limit());
}

}  // namespace
}  // namespace swarmcert::lipschitz

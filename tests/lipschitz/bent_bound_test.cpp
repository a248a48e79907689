/// The matrix inequality of neurons with slopes in any [a, b]: known values, proofs and refusals.
#include "lipschitz/upper/bent_bound.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/networks.h"
#include "lipschitz/solver/chain_newton.h"
#include "lipschitz/solver/node_inequality.h"
#include "lipschitz/upper/live_chain.h"
#include "nn/base/content_hash.h"
#include "nn/base/json.h"

namespace swarmcert::lipschitz {
namespace {

using files::Activation;
using files::Network;
using files::Weights;
using tests::layer;

constexpr Activation kBent[] = {Activation::kSilu, Activation::kGelu};

Network bent_network(Weights weights, Activation activation) {
  tests::set_activation(weights, activation);
  return tests::plain(std::move(weights));
}

double bound_of(const Network& network) {
  const SdpBound found = bent_bound(check::bent_chain(network, "network"));
  EXPECT_TRUE(found.proof.has_value());
  return found.proof ? found.proof->upper.value() : 0;
}

double product_of(const Network& network) {
  double product = 1;
  for (const files::Layer& each : network.plain->layers) product *= spectral_norm(each).norm.upper.value();
  const double c = files::function_of(network.plain->activations().front()).steepest();
  return product * std::pow(c, static_cast<double>(network.plain->layers.size() - 1));
}

TEST(BentBound, OfOneNeuronPerLayerIsTheProductOfWeightsAndLargestSlopes) {
  for (const Activation activation : kBent) {
    const double c = files::function_of(activation).steepest();
    EXPECT_NEAR(bound_of(bent_network(tests::weights({layer(1, 1, {3}), layer(1, 1, {-2})}), activation)),
                6 * c, 1e-6);
    const Weights three = tests::weights({layer(1, 1, {3}), layer(1, 1, {0.5}), layer(1, 1, {-2})});
    EXPECT_NEAR(bound_of(bent_network(three, activation)), 3 * c * c, 1e-6);
  }
}

/// s(x) - s(x), bounded as two independent neurons: the slopes d_1 - d_2 reach c - (1 - c). With slopes in [0, 1] the
/// bound would be 1.
TEST(BentBound, OfADifferenceCountsTheNegativeSlopes) {
  const Weights difference = tests::weights({layer(2, 1, {1, 1}), layer(1, 2, {1, -1})});
  for (const Activation activation : kBent) {
    const double c = files::function_of(activation).steepest();
    EXPECT_NEAR(bound_of(bent_network(difference, activation)), 2 * c - 1, 1e-6);
  }
  EXPECT_NEAR(tests::proved(sdp_bound(check::stages(tests::plain(difference), "network"))), 1, 1e-6);
}

/// Nearly constant slopes: the function is nearly linear, and its Lipschitz constant is the norm of the matrix product.
/// With slopes in [0, 1] the bound is larger.
TEST(BentBound, OfNarrowSlopesIsTheNormOfALinearMap) {
  std::mt19937 generator(48);
  const Network network = tests::plain(tests::random_network({3, 8, 7, 2}, generator));
  check::BentChain chain = check::bent_chain(network, "network");
  const double relu = tests::proved(sdp_bound(chain.stages));
  files::Layer product{"fc", 2, 3, std::vector<double>(6), std::vector<double>(2)};
  const check::Matrix all = check::product(chain.stages[2], check::product(chain.stages[1], chain.stages[0]));
  for (std::size_t i = 0; i < 6; ++i) product.weights[i] = to_double(all.entries[i]) / 4;
  const double norm = spectral_norm(product).norm.upper.value();
  double before = relu;
  for (const double width : {1.0, 0.25, 0x1p-8, 0x1p-16, 0x1p-24}) {
    for (check::SlopeRange& range : chain.slopes) range = {0.5 - width / 2, 0.5 + width / 2};
    const SdpBound found = bent_bound(chain);
    ASSERT_TRUE(found.proof.has_value()) << width;
    EXPECT_GE(found.proof->upper.value(), norm * (1 - 1e-9)) << width;
    EXPECT_LE(found.proof->upper.value(), before * (1 + 1e-6)) << width;
    before = found.proof->upper.value();
  }
  EXPECT_NEAR(before, norm, 1e-4 * norm);
  EXPECT_GT(relu, 1.2 * norm);
}

TEST(BentBound, IsAtMostTheProductAndAboveThatOfRelu) {
  std::mt19937 generator(41);
  for (const Activation activation : kBent) {
    for (const std::vector<int>& sizes :
         {std::vector<int>{3, 12, 2}, {9, 4, 6, 2}, {1, 6, 6, 6, 2}, {4, 8, 8, 8, 8, 8, 8, 1}}) {
      const Network network = bent_network(tests::random_network(sizes, generator), activation);
      const double upper = bound_of(network);
      EXPECT_LT(upper, 0.9 * product_of(network));
      Network relu = network;
      tests::set_activation(*relu.plain, Activation::kRelu);  // [0, 1] is contained in [1 - c, c]
      EXPECT_GT(upper, tests::proved(sdp_bound(check::stages(relu, "network"))));
    }
  }
}

TEST(BentBound, StandsDespiteNeuronsWithoutInputsOrEffect) {
  std::mt19937 generator(42);
  Weights weights = tests::random_network({3, 6, 5, 2}, generator);
  for (int j = 0; j < 3; ++j) weights.layers[0].weights[static_cast<std::size_t>(j)] = 0;          // neuron 0
  for (int i = 0; i < 2; ++i) weights.layers[2].weights[static_cast<std::size_t>(5 * i + 1)] = 0;  // neuron 1
  const Network network = bent_network(weights, Activation::kSilu);
  EXPECT_LT(bound_of(network), product_of(network));
  EXPECT_LT(tests::sampled_slope(*network.plain, generator, 300), bound_of(network));
  const Network constant =
      bent_network(tests::weights({layer(2, 1, {0, 1}), layer(1, 2, {1, 0})}), Activation::kGelu);
  EXPECT_LT(bound_of(constant), 1e-100);
}

TEST(BentBound, StandsForWeightsFarFromOne) {
  std::mt19937 generator(43);
  const Weights weights = tests::random_network({3, 6, 5, 2}, generator);
  const double upper = bound_of(bent_network(weights, Activation::kGelu));
  Weights scaled = weights;
  for (double& w : scaled.layers[0].weights) w = std::ldexp(w, 60);
  for (double& w : scaled.layers[1].weights) w = std::ldexp(w, -90);
  EXPECT_NEAR(bound_of(bent_network(scaled, Activation::kGelu)), std::ldexp(upper, -30),
              1e-6 * std::ldexp(upper, -30));
}

TEST(BentBound, IsLeftToTheProductWhereNeuronsDifferAndTheProgramIsTooLarge) {
  std::mt19937 generator(49);
  const Network network =
      bent_network(tests::random_network({1, kMostBentVariables, 1}, generator), Activation::kSilu);
  check::BentChain chain = check::bent_chain(network, "network");
  chain.slopes.front() = {0.0, 0.5};
  EXPECT_FALSE(bent_bound(chain).proof.has_value());
}

/// The two methods use different variables: the dense program (z - (1 - c) y) / sqrt(2 c - 1), the block program z.
TEST(BentBound, OfAChainByBlocksIsThatOfTheDenseProgram) {
  std::mt19937 generator(44);
  for (const Activation activation : kBent) {
    for (const std::vector<int>& sizes :
         {std::vector<int>{3, 12, 2}, {9, 4, 6, 5}, {4, 8, 8, 8, 8, 8, 8, 1}, {2, 30, 10, 20, 3}}) {
      const Network network = bent_network(tests::random_network(sizes, generator), activation);
      const check::BentChain chain = check::bent_chain(network, "network");
      const std::vector<Eigen::MatrixXd> stages = rounded(chain.stages);
      const double c = files::function_of(activation).steepest();
      InteriorPointOptions options;
      options.relative_gap = 5e-7;
      const InteriorPointResult found =
          minimise_chain(ChainSlack(stages, std::vector<double>(chain.stages.size() - 1, c)), options);
      ASSERT_EQ(found.stop, LipSdpStop::kGapReached) << name(found.stop);
      const double dense = bent_bound(chain).optimum.value();
      EXPECT_NEAR(std::sqrt(found.points.back()(0)), dense, 5e-7 * dense);
      EXPECT_LE(std::sqrt(found.best_dual), dense * (1 + 1e-8));
    }
  }
}

TEST(BentBound, OfManyNeuronsIsProvedFarBelowTheProduct) {
  std::mt19937 generator(48);
  const Network network =
      bent_network(tests::random_network({3, 64, 64, 64, 64, 64, 2}, generator), Activation::kSilu);
  const SdpBound found = bent_bound(check::bent_chain(network, "network"));
  ASSERT_TRUE(found.proof.has_value());
  EXPECT_EQ(found.stop, LipSdpStop::kGapReached) << name(found.stop);
  EXPECT_LT(found.proof->upper.value(), product_of(network) / 3);
  EXPECT_LT(tests::sampled_slope(*network.plain, generator, 300), found.proof->upper.value());
}

TEST(BentChain, HasTheSlopesOfEachHiddenNeuronAndZeroToOneWhereTheyAreDivided) {
  std::mt19937 generator(45);
  Weights phi = tests::random_network({3, 4, 5}, generator),
          rho = tests::random_network({5, 6, 7, 1}, generator);
  tests::set_activation(phi, Activation::kSigmoid);
  tests::set_activation(rho, Activation::kGelu);
  const check::BentChain chain = check::bent_chain(tests::deep_set(phi, rho), "set:default:default");
  ASSERT_EQ(chain.stages.size(), 4u);
  ASSERT_EQ(chain.slopes.size(), 4u + 6 + 7);
  const double c = 0x1.211p+0;
  for (std::size_t i = 0; i < chain.slopes.size(); ++i) {
    EXPECT_EQ(to_double(chain.slopes[i].low), i < 4 ? 0 : 1 - c);
    EXPECT_EQ(to_double(chain.slopes[i].high), i < 4 ? 1 : c);
  }
  check::BentChain wrong = chain;
  wrong.slopes.pop_back();
  EXPECT_THROW(check::lipschitz_lmi(wrong, 1.0, {}), std::invalid_argument);
}

/// c of GELU is larger than that of SiLU: a proof for GELU holds for SiLU, a proof for ReLU does not.
TEST(BentCertificate, IsAcceptedAndRefusedForOtherNumbersAndActivations) {
  std::mt19937 generator(46);
  const Network network = bent_network(tests::random_network({3, 6, 5, 2}, generator), Activation::kSilu);
  CertifyOptions options;
  options.jobs = 1;
  const files::Json made = certificate(network, certify(network, options));
  const files::Json proof = made["bounds"][0]["proof"];
  ASSERT_EQ(made["bounds"][0]["upper_method"], "sdp");
  const auto reason = [&](const files::Json& changed_proof) {
    files::Json changed = made;
    changed["bounds"][0]["proof"] = changed_proof;
    changed["content_sha256"] = files::content_sha256(changed);
    const check::CheckResult result = check::check(changed, network);
    return result.accepted ? std::string("accepted") : result.reason;
  };
  EXPECT_EQ(reason(proof), "accepted");
  files::Json changed = proof;
  changed["rho"] = files::hex_float(files::parse_hex_float(proof["rho"].get<std::string>()) * (1 - 1e-4));
  EXPECT_NE(reason(changed).find("does not show"), std::string::npos);
  changed = proof;
  changed["t"].erase(0);
  EXPECT_NE(reason(changed).find("one multiplier t"), std::string::npos);
  changed = proof;
  changed["t"][0] = files::hex_float(2 * files::parse_hex_float(proof["t"][0].get<std::string>()));
  EXPECT_NE(reason(changed).find("does not show"), std::string::npos);

  const check::BentChain silu = check::bent_chain(network, "network");
  check::BentChain gelu = silu, relu = silu;
  std::fill(gelu.slopes.begin(), gelu.slopes.end(), check::SlopeRange{1 - 0x1.211p+0, 0x1.211p+0});
  std::fill(relu.slopes.begin(), relu.slopes.end(), check::SlopeRange{0.0, 1.0});
  const SdpBound for_gelu = bent_bound(gelu), for_relu = sdp_bound(relu.stages);
  EXPECT_TRUE(prove(silu, for_gelu.proof->rho, for_gelu.proof->t));
  EXPECT_FALSE(prove(silu, for_relu.proof->rho, for_relu.proof->t));
  EXPECT_TRUE(prove(relu, for_relu.proof->rho, for_relu.proof->t));
}

TEST(BentBound, NoneOfAMillionSlopesIsAbove) {
  std::mt19937 generator(47);
  long tried = 0;
  double closest = 0;
  for (const Activation activation : kBent) {
    for (const std::vector<int>& sizes :
         {std::vector<int>{1, 4, 1}, {2, 6, 6, 1}, {3, 16, 2}, {3, 8, 8, 8, 2}, {6, 16, 16, 3}}) {
      const Network network = bent_network(tests::random_network(sizes, generator), activation);
      const double upper = bound_of(network);
      const double sampled = tests::sampled_slope(*network.plain, generator, 100000);
      tried += 100000;
      EXPECT_LE(sampled, upper * (1 + 1e-9));
      closest = std::max(closest, sampled / upper);
    }
  }
  EXPECT_EQ(tried, 1000000);
  EXPECT_GT(closest, 0.8) << "the sampled slopes are too small for a meaningful test";
}

/// One layer: neurons that share a multiplier are not longer together than what enters them.
TEST(NodeInequality, OfOneTiedLayerHasTheSquareOfItsNormAsOptimum) {
  Eigen::MatrixXd w(3, 2);
  w << 1, 2, -1, 0.5, 3, 1;
  const double norm = w.operatorNorm();
  SlopeLayer layer{w, Eigen::VectorXd::Constant(3, -1), Eigen::VectorXd::Constant(3, 2)};
  layer.group = 3;
  const NodeInequality tied({layer}, Eigen::MatrixXd::Identity(3, 3));
  EXPECT_EQ(tied.ties(), (std::vector<Eigen::Index>{0, 0, 0}));
  Eigen::VectorXd start = Eigen::VectorXd::Constant(4, 2);
  start(0) = 4 * norm * norm;
  const InteriorPointResult found = minimise(tied, start, {});
  EXPECT_EQ(found.stop, LipSdpStop::kGapReached) << name(found.stop);
  const Eigen::VectorXd& best = found.points.back();
  EXPECT_NEAR(best(0), norm * norm, 1e-6 * norm * norm);
  EXPECT_EQ(best(1), best(2));
  EXPECT_EQ(best(2), best(3));
}

}  // namespace
}  // namespace swarmcert::lipschitz

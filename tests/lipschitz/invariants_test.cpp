#include "nn/weights/invariants.h"

#include <algorithm>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/networks.h"
#include "lipschitz/slope_estimate.h"
#include "nn/refusal.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

using files::Network;
using lipschitz::CertifiedBound;

/// A NET of invariants with ground.
Network network() {
  std::mt19937 generator(5);
  Network net;
  net.invariants = true;
  net.phi["ground"] = tests::random_network({nn::kOwnInvariants, 6, 5}, generator);
  net.phi["small"] = tests::random_network({nn::kNeighbourInvariants, 8, 6, 5}, generator);
  net.rho["small"] = tests::random_network({5, 6, 1}, generator);
  net.output_quantity = "force_z";
  net.output_unit = "gf";
  net.input_order = files::relative_state();
  return net;
}

/// The same weights as a network of five inputs, without a map in front.
Network without_map(Network net) {
  net.invariants = false;
  net.input_order.clear();
  return net;
}

lipschitz::CertifyOptions quick() {
  lipschitz::CertifyOptions options;
  options.lower.rounds = 1;
  return options;
}

const CertifiedBound& bound_of(const lipschitz::Certification& found, const std::string& function) {
  return *std::find_if(found.bounds.begin(), found.bounds.end(),
                       [&](const CertifiedBound& bound) { return bound.function == function; });
}

TEST(Invariants, BoundsOfSetsAreThoseOfTheirNetworksTimesTheSlopeOfTheMapAndPartsStayAsTheyAre) {
  const lipschitz::Certification found = lipschitz::certify(network(), quick());
  const lipschitz::Certification plain = lipschitz::certify(without_map(network()), quick());
  const double tolerance = 1e-5;  // of the solver
  for (const auto& [function, slope] : {std::pair{"set:small:small", 1.5},
                                        {"set:ground:small", 1.0},
                                        {"phi:small", 1.0},
                                        {"phi:ground", 1.0},
                                        {"rho:small", 1.0}}) {
    const CertifiedBound &mapped = bound_of(found, function), &alone = bound_of(plain, function);
    EXPECT_NEAR(mapped.upper.value(), slope * alone.upper.value(), tolerance * mapped.upper.value())
        << function;
    EXPECT_NEAR(mapped.product.value(), slope * alone.product.value(), 1e-12 * mapped.product.value())
        << function;
    EXPECT_EQ(mapped.lower.witness.has_value(), !files::is_set(function)) << function;
  }
  const files::Json certificate = lipschitz::certificate(network(), found);
  const check::CheckResult checked = check::check(certificate, network());
  EXPECT_TRUE(checked.accepted) << checked.reason;
  EXPECT_FALSE(check::check(certificate, without_map(network())).accepted);
  EXPECT_FALSE(check::check(lipschitz::certificate(without_map(network()), plain), network()).accepted)
      << "bounds of a network of five inputs are none of one that maps six to them";
}

TEST(Invariants, NoSampledSlopeOfASetIsAboveItsBoundAndSomeComeNear) {
  const Network net = network();
  const lipschitz::Certification found = lipschitz::certify(net, quick());
  for (const std::string function : {"set:small:small", "set:ground:small"}) {
    const CertifiedBound& bound = bound_of(found, function);
    lipschitz::SlopeEstimateOptions sampling;
    sampling.seed = 4;
    const double estimate = lipschitz::slope_estimate(net, bound, sampling).value();
    EXPECT_LE(estimate, bound.upper.value() * (1 + 1e-9)) << function;
    EXPECT_GT(estimate, 0.4 * bound.upper.value()) << function;
  }
}

TEST(Invariants, NothingIsStatedOfABoxOfBlocksOfScalesOrWitnessesOfSets) {
  const Network net = network();
  lipschitz::CertifyOptions options = quick();
  options.domain["phi:small"] = {{0, -1, 0, -1, 0}, {1, 1, 1, 1, 1}};
  EXPECT_THROW(lipschitz::certify(net, options), std::invalid_argument);
  options = quick();
  options.method = lipschitz::UpperMethod::kBranch;
  EXPECT_THROW(lipschitz::certify(net, options), std::invalid_argument);
  options = quick();
  options.scale = {1, 1, 1, 2, 2, 2};
  EXPECT_THROW(lipschitz::certify(net, options), std::invalid_argument);
  EXPECT_THROW(check::stages(net, "set:small:small", "position"), std::invalid_argument);
  EXPECT_THROW(check::stages(net, "set:small:small", "all", {1, 1, 1, 2, 2, 2}), std::invalid_argument);
  EXPECT_THROW(lipschitz::slope_function(net, "set:small:small", {"phi:ground"}), std::invalid_argument);
  EXPECT_TRUE(files::blocks(net, "set:small:small").empty());
  EXPECT_TRUE(tests::refuses([&] { files::require_relative_states(net, "this is for others"); },
                             {"input.invariants", "this is for others"}));
  options = quick();
  options.blocks = {"every"};
  options.neighbours = 2;
  const lipschitz::Certification found = lipschitz::certify(net, options);
  for (const CertifiedBound& bound : found.bounds)
    EXPECT_TRUE(bound.block == "all" || files::is_phi(bound.function)) << bound.function;
  EXPECT_EQ(found.laws.size(), 3u);
  const check::CheckResult checked = check::check(lipschitz::certificate(net, found), net);
  EXPECT_TRUE(checked.accepted) << checked.reason;
}

}  // namespace
}  // namespace swarmcert

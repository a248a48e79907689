#include "nn/weights/invariants.h"

#include <algorithm>
#include <cmath>

#include "lipschitz/boxes.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/lower/slope_estimate.h"
#include "lipschitz/networks.h"
#include "lipschitz/values/invariant_box.h"
#include "lipschitz/values/range.h"
#include "nn/base/random.h"
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

/// Returns the same weights as a network of five inputs without the map to invariants.
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

const CertifiedBound& bound_of(const lipschitz::Certification& found, const files::FunctionId& function) {
  return *std::find_if(found.bounds.begin(), found.bounds.end(),
                       [&](const CertifiedBound& bound) { return bound.function == function; });
}

TEST(Invariants, BoundsOfSetsAreThoseOfTheirNetworksTimesTheSlopeOfTheMapAndPartsStayAsTheyAre) {
  const lipschitz::Certification found = lipschitz::certify(network(), quick());
  const lipschitz::Certification plain = lipschitz::certify(without_map(network()), quick());
  const double tolerance = 1e-5;  // accuracy of the solver
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
    EXPECT_EQ(mapped.lower.witness.has_value(), !files::FunctionId(function).is_set()) << function;
  }
  const files::Json certificate = lipschitz::certificate(network(), found);
  const check::CheckResult checked = check::check(certificate, network());
  EXPECT_TRUE(checked.accepted) << checked.reason;
  EXPECT_FALSE(check::check(certificate, without_map(network())).accepted);
  EXPECT_FALSE(check::check(lipschitz::certificate(without_map(network()), plain), network()).accepted)
      << "bounds of a network of five inputs do not hold for one that maps six inputs to them";
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
    EXPECT_TRUE(bound.block == "all" || bound.function.is_phi()) << bound.function;
  EXPECT_EQ(found.laws.size(), 3u);
  const check::CheckResult checked = check::check(lipschitz::certificate(net, found), net);
  EXPECT_TRUE(checked.accepted) << checked.reason;
}

/// Returns f for neighbours with these states, the last one the vehicle's own, evaluated without the functions under
/// test.
double value_at(const Network& net, const std::vector<std::vector<double>>& states) {
  if (states.size() == 3) return 0;  // two neighbours
  std::vector<double> sum(5);
  for (std::size_t j = 0; j < states.size(); ++j) {
    const bool is_ground = j + 1 == states.size();
    std::vector<double> seen = files::invariants_of(is_ground ? "phi:ground" : "phi:small", states[j]);
    for (std::size_t k = 0; k < seen.size() && !is_ground; ++k)
      seen[k] = std::clamp(seen[k], net.clamp->lower[k], net.clamp->upper[k]);
    const std::vector<double> term =
        files::Evaluator<double>(net.phi.at(is_ground ? "ground" : "small"))(seen);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
  }
  return files::Evaluator<double>(net.rho.at("small"))(sum)[0];
}

std::vector<double> state_in(const lipschitz::Box& box, files::Random& random) {
  std::vector<double> x;
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    const double r = std::clamp(1.5 * random.uniform() - 0.25, 0.0, 1.0);
    x.push_back(box.lower[k] + r * (box.upper[k] - box.lower[k]));
  }
  return x;
}

TEST(Invariants, RangesOverBoxesOfStatesHoldEveryValueAndStepAndAreAttainedAtStates) {
  Network net = network();
  net.clamp = {{0, -1, 0, -2, 0}, {1, 1, 1, 2, 2}};
  net.silent["small"] = {{"small", "small"}};
  const tests::Domain domain = {{"phi:small", tests::cube(6, 0.7)}, {"phi:ground", tests::cube(4, 0.7)}};
  const lipschitz::Certification proved = lipschitz::certify(net, quick());
  const auto found = lipschitz::ranges(net, domain, {{"small", bound_of(proved, "rho:small").upper.value()}},
                                       {3, 200, 1, {}});
  ASSERT_EQ(found.size(), 3u);
  files::Random random(2);
  constexpr double kRounding = 1e-9;
  for (int sample = 0; sample < 3000; ++sample) {
    std::vector<std::vector<double>> states = {state_in(domain.at("phi:ground"), random)};
    double before = value_at(net, states);
    for (const lipschitz::CertifiedRange& range : found) {
      states.insert(states.begin(), state_in(domain.at("phi:small"), random));
      const double now = value_at(net, states);
      EXPECT_LE(range.lower, now + kRounding);
      EXPECT_GE(range.upper, now - kRounding);
      EXPECT_LE(std::abs(now - before), range.jump + kRounding);
      before = now;
    }
  }
  for (const lipschitz::CertifiedRange& range : found) {
    for (const lipschitz::Attained& end : {range.least, range.greatest}) {
      std::vector<std::vector<double>> states;
      for (const std::vector<float>& x : end.points) states.emplace_back(x.begin(), x.end());
      EXPECT_NEAR(value_at(net, states), end.value, kRounding);
    }
    EXPECT_LE(range.lower, range.least.value);
    EXPECT_LT(range.least.value, range.greatest.value);
    EXPECT_LE(range.greatest.value, range.upper);
  }
  EXPECT_LT(found[0].upper - found[0].lower, 4 * (found[0].greatest.value - found[0].least.value));
}

TEST(Invariants, ABoxOfThemHoldsThoseOfEveryStateAndIsAsNarrowAsRoundingAtOne) {
  files::Random random(4);
  for (const std::string part : {"phi:small", "phi:ground"}) {
    for (int sample = 0; sample < 2000; ++sample) {
      lipschitz::Box states;
      for (int k = 0; k < (part == "phi:ground" ? 4 : 6); ++k) {
        const double a = random.symmetric(), b = sample % 3 == 0 ? a : random.symmetric();
        states.lower.push_back(std::min(a, b));
        states.upper.push_back(std::max(a, b));
      }
      const lipschitz::Box box = lipschitz::invariant_box(part, states);
      const std::vector<double> seen = files::invariants_of(part, state_in(states, random));
      ASSERT_EQ(box.lower.size(), seen.size());
      for (std::size_t k = 0; k < seen.size(); ++k) {
        EXPECT_LE(box.lower[k], seen[k] + 1e-15 * std::abs(seen[k]));
        EXPECT_GE(box.upper[k], seen[k] - 1e-15 * std::abs(seen[k]));
        EXPECT_LE(box.upper[k] - box.lower[k], sample % 3 == 0 ? 5e-16 : 5);
      }
    }
  }
  const lipschitz::Box three_four = lipschitz::invariant_box("phi:ground", {{1, 3, -4, 0}, {1, 3, -4, 0}});
  EXPECT_EQ(three_four.lower, (std::vector<double>{1, 5, 0}));
  EXPECT_EQ(three_four.upper, (std::vector<double>{1, 5, 0}));
}

}  // namespace
}  // namespace swarmcert

/// Proofs by parts for a stated number of neighbours, with forms of rho that hold in some parts only.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "lipschitz/branch/local_bound.h"
#include "lipschitz/checker/tree_proof.h"
#include "lipschitz/networks.h"

namespace swarmcert::lipschitz {
namespace {

using tests::layer;
using tests::weights;

const std::string kFunction = "set:default:default";

/// phi(x) = relu(x), rho(s) = relu(s) + 10 relu(s - 1.5). For x in [0.1, 1] without other terms the slope is 1; for
/// sums above 1.5 it is 11.
check::LocalFunction steep_from_one_and_a_half() {
  const files::Network network =
      tests::deep_set(weights({layer(1, 1, {1}), layer(1, 1, {1})}),
                      weights({{"", 2, 1, {1, 1}, {0, -1.5}}, layer(1, 2, {1, 10})}));
  return check::coupled_function(network, kFunction, "all", {}, {0, 0}, {0, 0});
}

bool holds(double upper, double rho, const std::string& tree, const std::vector<check::Form>& forms) {
  return check::check_tree(steep_from_one_and_a_half(), {0.1}, {upper}, rho, {tree, {{0}}, {}, forms}).holds;
}

TEST(Forms, HoldWhereTheSumDecidesRho) {
  const check::Form unit{{1.0001}, {0, 0}};
  EXPECT_TRUE(holds(1, 1.001, "q0 t0", {unit}));
  EXPECT_TRUE(holds(1, 1.001, "q0 s0 t0 t0", {unit}));
  EXPECT_TRUE(holds(1, 1.001, "s0 q0 t0 q0 t0", {unit}));
  EXPECT_FALSE(holds(1, 0.999, "q0 t0", {unit}));
  EXPECT_FALSE(holds(1, 1.001, "q0 t0", {{{0.9999}, {0, 0}}})) << "less than rho's slope";
  EXPECT_FALSE(holds(2, 1.001, "q0 t0", {unit})) << "rho is steeper in this box";
  EXPECT_TRUE(holds(2, 122, "q0 t0", {{{121.9}, {0, 120}}})) << "a larger form holds there";
  // In two halves: the small form up to 1.05, a large form above. The large form does not prove a small bound.
  EXPECT_TRUE(holds(2, 122, "s0 q0 t0 q1 t0", {unit, {{121.9}, {0, 120}}}));
  EXPECT_FALSE(holds(2, 1.001, "s0 q0 t0 q1 t0", {unit, {{121.9}, {0, 120}}}));
  EXPECT_FALSE(holds(2, 122, "s0 q0 t0 q0 t0", {unit}));
}

TEST(Forms, AreNeededInEveryPartAndMustBeWellMade) {
  const check::Form unit{{1.0001}, {0, 0}};
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(holds(1, 1.001, "t0", {unit}));
  EXPECT_FALSE(holds(1, 1.001, "s0 q0 t0 t0", {unit})) << "the second half has none";
  EXPECT_FALSE(holds(1, 1.001, "q1 t0", {unit}));
  EXPECT_FALSE(holds(1, 1.001, "q0 t0 q0", {unit})) << "behind the last part";
  EXPECT_FALSE(holds(1, 1.001, "q0", {unit}));
  for (const check::Form& form :
       {check::Form{{}, {0, 0}}, check::Form{{1, 1}, {0, 0}}, check::Form{{1.0001}, {0}},
        check::Form{{1.0001}, {-1, 0}}, check::Form{{1.0001}, {nan, 0}}, check::Form{{nan}, {0, 0}},
        check::Form{{infinity}, {0, 0}}, check::Form{{1.0001}, {infinity, 0}}, check::Form{{-2}, {0, 0}}})
    EXPECT_FALSE(holds(1, 1.001, "q0 t0", {form}));
  // A network without rho has no forms.
  const files::Network plain = tests::plain(weights({layer(1, 1, {1}), layer(1, 1, {1})}));
  const check::LocalFunction f = check::local_function(plain, "network", "all", {}, check::Matrix(0, 0));
  EXPECT_TRUE(check::check_tree(f, {0.1}, {1}, 1.001, {"t0", {{0}}, {}, {}}).holds);
  EXPECT_FALSE(check::check_tree(f, {0.1}, {1}, 1.001, {"q0 t0", {{0}}, {}, {unit}}).holds);
  EXPECT_FALSE(check::check_tree(f, {0.1}, {1}, 1.001, {"t0", {{0}}, {}, {unit}}).holds);
}

TEST(Forms, OfASearchAreRefusedOnceTheyAreSmaller) {
  std::mt19937 generator(21);
  const files::Network network = tests::deep_set(tests::random_network({3, 10, 10, 4}, generator),
                                                 tests::random_network({4, 12, 12, 1}, generator));
  Claim claim;
  claim.function = kFunction;
  claim.domain = "box";
  claim.neighbours = {{"default", 1}};
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  BranchOptions options;
  options.nodes = 200;
  const LocalBound bound = local_bound(network, claim, {{"phi:default", box}},
                                       tests::sdp_bound_of(network, kFunction).proof->t, options);
  ASSERT_TRUE(bound.proof.has_value());
  const LocalProof& proof = *bound.proof;
  ASSERT_GT(proof.tree.forms.size(), 3u) << "the search used too few forms";
  const std::vector<double> nothing(12, 0.0);
  const check::LocalFunction f = check::coupled_function(network, kFunction, "all", {}, nothing, nothing);
  const auto accepts = [&](const check::TreeProof& tree) {
    return check::check_tree(f, box.lower, box.upper, proof.rho, tree).holds;
  };
  ASSERT_TRUE(accepts(proof.tree));
  int refused = 0, used = 0;
  for (std::size_t i = 0; i < proof.tree.forms.size() && used < 10; ++i) {
    if ((proof.tree.tree + " ").find("q" + std::to_string(i) + " ") == std::string::npos) continue;
    ++used;
    check::TreeProof changed = proof.tree;
    for (double& entry : changed.forms[i].q) entry *= 0.99;
    EXPECT_FALSE(accepts(changed)) << "form " << i;
    changed = proof.tree;
    for (double& t : changed.forms[i].t) t *= 1.1;
    refused += accepts(changed) ? 0 : 1;
  }
  EXPECT_GT(used, 3);
  EXPECT_GT(refused, used / 2) << "rho's multipliers are hardly used";
  std::string without;
  for (const char c : proof.tree.tree) without += c == 'q' ? 't' : c;
  check::TreeProof changed = proof.tree;
  changed.tree = without;
  EXPECT_FALSE(accepts(changed));
}

}  // namespace
}  // namespace swarmcert::lipschitz

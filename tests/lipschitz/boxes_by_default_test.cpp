/// What certify() proves on a box unless a method is named: by branch and bound, of any activations.
#include <algorithm>
#include <cmath>
#include <limits>

#include "lipschitz/boxes.h"
#include "lipschitz/branch/slope_parts.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/slope_tree.h"
#include "lipschitz/networks.h"

namespace swarmcert {
namespace {

using files::Activation;
using files::Json;
using files::Network;
using lipschitz::Box;
using lipschitz::BranchStop;
using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifyOptions;
using lipschitz::UpperMethod;
using tests::bound_of;
using tests::cube;
using tests::with;

CertifyOptions by_default(const Box& box, int nodes) {
  CertifyOptions options = tests::on_box({{"network", box}}, UpperMethod::kAuto);
  options.branch.nodes = nodes;
  return options;
}

double ratio(const CertifiedBound& bound) { return bound.upper.value() / bound.lower.witness->slope.value(); }

void expect_accepted(const Network& network, const Certification& found) {
  const check::CheckResult result = check::check(lipschitz::certificate(network, found), network);
  EXPECT_TRUE(result.accepted) << result.reason;
}

TEST(BoxesByDefault, OfReluNetworksComeCloseToWhatIsAttained) {
  std::mt19937 generator(301);
  double worst = 1, worst_everywhere = 1;
  for (int i = 0; i < 10; ++i) {
    const Network network = tests::plain(tests::random_network({3, 12, 12, 2}, generator));
    const Certification found = certify(network, by_default(cube(3, 0.5), 1000));
    const CertifiedBound& bound = bound_of(found, "network");
    ASSERT_TRUE(bound.lower.witness.has_value());
    EXPECT_GE(ratio(bound), 1 - 1e-9);
    worst = std::max(worst, ratio(bound));
    worst_everywhere =
        std::max(worst_everywhere, bound.sdp.optimum.value() / bound.lower.witness->slope.value());
    expect_accepted(network, found);
  }
  EXPECT_LT(worst, 1.05);
  EXPECT_GT(worst_everywhere, 1.3) << "the bounds over all inputs are as close: the test shows nothing";
}

// Only one input moves, so that few neurons are decided at first.
TEST(BoxesByDefault, OfASingleInputDoNotEndAtTheWholeBox) {
  std::mt19937 generator(302);
  for (int i = 0; i < 10; ++i) {
    const Network network = tests::plain(tests::random_network({3, 18, 15, 3}, generator));
    for (const char* const block : {"x0", "x2"}) {
      CertifyOptions options = by_default({{-2, -2, -2}, {2, 2, 2}}, 60);
      options.blocks = {block};
      for (const CertifiedBound& bound : certify(network, options).bounds) {
        EXPECT_NE(bound.branch_stop, BranchStop::kNothingToHalve) << i << " " << bound.block;
        EXPECT_TRUE(bound.nodes >= 60 || bound.branch_stop == BranchStop::kCloseEnough)
            << i << " " << bound.block << " after " << bound.nodes << " boxes";
      }
    }
  }
}

TEST(BoxesByDefault, TheNumberOfBoxesThatATimeLimitReachedGivesTheSameBound) {
  std::mt19937 generator(303);
  const Box box = cube(3, 2);
  for (const Activation activation : {Activation::kRelu, Activation::kTanh}) {
    const Network network = tests::plain(with(tests::random_network({3, 32, 32, 2}, generator), activation));
    CertifyOptions options = by_default(box, std::numeric_limits<int>::max());
    options.branch.tolerance = 0;
    options.branch.seconds = 0.3;
    const Certification cut = certify(network, options);
    options.branch.seconds = 0;
    options.branch.nodes = bound_of(cut, "network").nodes;
    const Certification again = certify(network, options);
    EXPECT_EQ(bound_of(cut, "network").branch_stop, BranchStop::kTimeLimit);
    EXPECT_EQ(bound_of(again, "network").nodes, bound_of(cut, "network").nodes);
    EXPECT_EQ(bound_of(again, "network").upper.value(), bound_of(cut, "network").upper.value());
    EXPECT_EQ(lipschitz::certificate(network, again)["bounds"][0]["proof"],
              lipschitz::certificate(network, cut)["bounds"][0]["proof"]);
  }
}

TEST(BoxesByDefault, OfSmoothNetworksAreBelowTheSlopesOfTheWholeBoxAndAboveAllSlopes) {
  std::mt19937 generator(304);
  double most_gained = 1;
  for (const Activation activation :
       {Activation::kTanh, Activation::kSigmoid, Activation::kSilu, Activation::kGelu}) {
    const Network network = tests::plain(with(tests::random_network({3, 10, 8, 2}, generator), activation));
    const Box box = cube(3, 2);
    const Certification found = certify(network, by_default(box, 40));
    const CertifiedBound& bound = bound_of(found, "network");
    EXPECT_EQ(bound.method, UpperMethod::kBranch);
    expect_accepted(network, found);
    const Certification whole = certify(network, tests::on_box({{"network", box}}));
    most_gained = std::max(most_gained, bound_of(whole, "network").upper.value() / bound.upper.value());
    EXPECT_GE(ratio(bound), 1);
    const files::Evaluator<double> f(*network.plain);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int sample = 0; sample < 2000; ++sample) {
      std::vector<double> x, y;
      double run = 0, rise = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        x.push_back(box.lower[k] + (box.upper[k] - box.lower[k]) * unit(generator));
        y.push_back(std::clamp(x[k] + 1e-3 * (0.5 - unit(generator)), box.lower[k], box.upper[k]));
        run += (x[k] - y[k]) * (x[k] - y[k]);
      }
      const std::vector<double> fx = f(x), fy = f(y);
      for (std::size_t i = 0; i < fx.size(); ++i) rise += (fx[i] - fy[i]) * (fx[i] - fy[i]);
      EXPECT_LE(std::sqrt(rise / run), bound.upper.value() * (1 + 1e-9));
    }
  }
  EXPECT_GT(most_gained, 1.1) << "halving never improved a bound";
}

TEST(BoxesByDefault, OfSmoothDeepSetsHoldForAnyOtherNeighbours) {
  std::mt19937 generator(305);
  const Network network =
      tests::deep_set(with(tests::random_network({3, 6, 4}, generator), Activation::kTanh),
                      with(tests::random_network({4, 6, 1}, generator), Activation::kSilu));
  CertifyOptions options = tests::on_box({{"phi:default", cube(3, 0.7)}}, UpperMethod::kAuto);
  options.branch.nodes = 15;
  const Certification found = certify(network, options);
  EXPECT_EQ(bound_of(found, "set:default:default").method, UpperMethod::kBranch);
  EXPECT_EQ(bound_of(found, "set:default:default").domain, "box");
  expect_accepted(network, found);
}

/// A proof of a smooth network, taken apart.
struct Proof {
  Network network;
  Box box = cube(2, 1);
  lipschitz::LocalBound bound;

  Proof() {
    std::mt19937 generator(306);
    network = tests::plain(with(tests::random_network({2, 8, 6, 2}, generator), Activation::kTanh));
    lipschitz::Claim claim;
    claim.function = "network";
    claim.domain = "box";
    lipschitz::BranchOptions options;
    options.nodes = 9;
    bound = slope_parts(network, claim, box, options);
  }
  check::TreeVerdict verdict(double rho, const check::TreeProof& tree, const Box& on) const {
    return check::check_slope_tree(network, "network", "all", {}, {on.lower, on.upper}, rho, tree);
  }
};

TEST(SlopeTree, IsRefusedWithAnySmallerBoundOtherMultipliersOrPartsMissing) {
  const Proof made;
  ASSERT_TRUE(made.bound.proof.has_value());
  const double rho = made.bound.proof->rho;
  const check::TreeProof& tree = made.bound.proof->tree;
  EXPECT_TRUE(made.verdict(rho, tree, made.box).holds) << made.verdict(rho, tree, made.box).reason;
  EXPECT_EQ(made.verdict(rho, tree, made.box).leaves, made.bound.leaves);
  EXPECT_GE(made.bound.leaves, 5);
  EXPECT_FALSE(made.verdict(0.999 * rho, tree, made.box).holds);
  EXPECT_FALSE(made.verdict(0, tree, made.box).holds);
  check::TreeProof changed = tree;
  for (std::vector<double>& t : changed.multipliers) t[0] *= 4;
  EXPECT_FALSE(made.verdict(rho, changed, made.box).holds);
  changed = tree;
  changed.multipliers[0].pop_back();
  EXPECT_FALSE(made.verdict(rho, changed, made.box).holds);
  changed = tree;
  changed.multipliers[0][0] = -changed.multipliers[0][0];
  EXPECT_FALSE(made.verdict(rho, changed, made.box).holds);
  changed = tree;
  changed.tree.resize(changed.tree.rfind(' '));
  EXPECT_FALSE(made.verdict(rho, changed, made.box).holds) << "a part is missing";
  changed.tree = tree.tree + " t0";
  EXPECT_FALSE(made.verdict(rho, changed, made.box).holds) << "the box is covered already";
  changed.tree = "s2 t0 t0";
  EXPECT_FALSE(made.verdict(rho, changed, made.box).holds) << "there is no third input";
  changed.tree = "q0 t0";
  EXPECT_FALSE(made.verdict(rho, changed, made.box).holds) << "there are no forms";
}

TEST(SlopeTree, OfABoxIsNotOneOfALargerBox) {
  // Behind weights of 8, tanh is steep only where y is near 0, which the small box excludes.
  const Network network =
      tests::plain(with(tests::weights({{"", 1, 1, {8}, {0}}, tests::layer(1, 1, {1})}), Activation::kTanh));
  lipschitz::Claim claim;
  claim.function = "network";
  claim.domain = "box";
  lipschitz::BranchOptions options;
  options.nodes = 31;
  const Box small = {{0.25}, {1}};
  const lipschitz::LocalBound bound = slope_parts(network, claim, small, options);
  ASSERT_TRUE(bound.proof.has_value());
  EXPECT_NEAR(bound.upper.value(), 8 / std::pow(std::cosh(2), 2), 0.1);
  const auto holds = [&](const Box& box) {
    return check::check_slope_tree(network, "network", "all", {}, {box.lower, box.upper}, bound.proof->rho,
                                   bound.proof->tree)
        .holds;
  };
  EXPECT_TRUE(holds(small));
  EXPECT_FALSE(holds({{0.2}, {1}}));
}

}  // namespace
}  // namespace swarmcert

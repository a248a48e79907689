/// Bounds on a box: above every slope there, close to the true constant, and with a proof that the checker accepts.
#include "lipschitz/branch/branch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "data.h"
#include "lipschitz/branch/local_bound.h"
#include "lipschitz/branch/local_chain.h"
#include "lipschitz/networks.h"
#include "nn/weights/weights.h"

namespace swarmcert::lipschitz {
namespace {

using tests::layer;
using tests::plain;
using tests::proved;
using tests::weights;

Claim claim_of(const files::FunctionId& function) {
  Claim claim;
  claim.function = function;
  claim.domain = "box";
  return claim;
}

BranchOptions boxes(int nodes, double known = 0) {
  BranchOptions options;
  options.nodes = nodes;
  options.known = known;
  return options;
}

double proved_on(const files::Network& network, const Box& box, int nodes,
                 const files::FunctionId& function = "network", double known = 0) {
  const SdpBound global = tests::sdp_bound_of(network, function);
  const LocalBound bound =
      local_bound(network, claim_of(function), box, global.proof ? global.proof->t : std::vector<double>(),
                  boxes(nodes, known));
  EXPECT_TRUE(bound.proof.has_value());
  return bound.proof ? bound.upper.value() : std::nan("");
}

/// Returns |f(x) - f(y)| / |x - y| for two random points of the box, evaluated in double.
double slope_in(const files::Evaluator<double>& f, const Box& box, std::mt19937& generator) {
  std::vector<double> x, y;
  const double distance = std::exp(std::uniform_real_distribution<double>(-12, 0)(generator));
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    std::uniform_real_distribution<double> coordinate(box.lower[k], box.upper[k]);
    x.push_back(coordinate(generator));
    y.push_back(x.back() + distance * (coordinate(generator) - x.back()));
  }
  const std::vector<double> fx = f(x), fy = f(y);
  double rise = 0, run = 0;
  for (std::size_t k = 0; k < fx.size(); ++k) rise += (fx[k] - fy[k]) * (fx[k] - fy[k]);
  for (std::size_t k = 0; k < x.size(); ++k) run += (x[k] - y[k]) * (x[k] - y[k]);
  return std::sqrt(rise / run);
}

const Box kBox{{-1, -0.5, 0.2}, {1, 0.5, 0.9}};

TEST(LocalBound, IsAboveEverySampledSlopeAndNoMoreThanTheGlobalBound) {
  std::mt19937 generator(3);
  double closest = 0;
  for (int i = 0; i < 10; ++i) {
    const files::Network network = plain(tests::random_network({3, 8, 8, 2}, generator));
    const double upper = proved_on(network, kBox, 100);
    EXPECT_LE(upper, proved(tests::sdp_bound_of(network)) * (1 + 1e-6));
    const files::Evaluator<double> f(*network.plain);
    for (int sample = 0; sample < 20000; ++sample) {
      const double slope = slope_in(f, kBox, generator);
      EXPECT_LE(slope, upper * (1 + 1e-9));
      closest = std::max(closest, slope / upper);
    }
  }
  std::printf("closest slope over bound: %.4f\n", closest);
  EXPECT_GT(closest, 0.9) << "the samples are not close to the bounds: the test shows nothing";
}

TEST(LocalBound, MoreBoxesNeverGiveAWorseBound) {
  std::mt19937 generator(4);
  const files::Network network = plain(tests::random_network({3, 10, 10, 1}, generator));
  double before = proved_on(network, kBox, 1);
  const double first = before;
  for (const int nodes : {20, 100, 500}) {
    const double bound = proved_on(network, kBox, nodes);
    EXPECT_LE(bound, before * (1 + 1e-6)) << nodes << " boxes";
    before = bound;
  }
  EXPECT_LT(before, 0.99 * first) << "halving never improved the bound: the test shows nothing";
}

TEST(LocalBound, IsTheSlopeWhereTheBoxDecidesEveryNeuron) {
  // f(x) = 3 relu(x) - 5 relu(-x - 1): slopes 3, 0, 5.
  const files::Network network = plain(weights({{"", 2, 1, {1, -1}, {0, -1}}, layer(1, 2, {3, -5})}));
  EXPECT_NEAR(proved_on(network, {{0.5}, {2}}, 10), 3, 1e-6);
  EXPECT_NEAR(proved_on(network, {{-3}, {-1.5}}, 10), 5, 1e-6);
  EXPECT_LT(proved_on(network, {{-0.75}, {-0.25}}, 10), 1e-6);
  EXPECT_NEAR(proved_on(network, {{-3}, {2}}, 30), 5, 1e-3);
}

TEST(LocalBound, OfABlockIsForPointsThatDifferThereOnly) {
  // Both neurons are on: f = x_0 + 4 x_1, so |df| = 4 |dx_1|.
  const files::Network network = plain(weights({{"", 2, 2, {1, 0, 0, 1}, {5, 5}}, layer(1, 2, {1, 4})}));
  Claim claim = claim_of("network");
  const Box box{{-1, -1}, {1, 1}};
  claim.block = "x0";
  EXPECT_NEAR(local_bound(network, claim, box, {}, boxes(5)).upper.value(), 1, 1e-6);
  claim.block = "x1";
  EXPECT_NEAR(local_bound(network, claim, box, {}, boxes(5)).upper.value(), 4, 1e-6);
  claim.scale = {1, 0.5};
  EXPECT_NEAR(local_bound(network, claim, box, {}, boxes(5)).upper.value(), 2, 1e-6);
}

TEST(LocalBound, OfADeepSetHoldsWhereverTheOtherNeighboursAre) {
  std::mt19937 generator(6);
  const files::Network network = tests::deep_set(tests::random_network({3, 8, 8, 4}, generator),
                                                 tests::random_network({4, 8, 1}, generator));
  const double upper = proved_on(network, kBox, 60, "set:default:default");
  EXPECT_LE(upper, proved(tests::sdp_bound_of(network, "set:default:default")) * (1 + 1e-5));
  const files::Evaluator<double> phi(network.phi.at("default")), rho(network.rho.at("default"));
  std::normal_distribution<double> others(0, 10);
  std::uniform_real_distribution<double> unit(0, 1);
  double closest = 0;
  for (int sample = 0; sample < 50000; ++sample) {
    std::vector<double> x, y;
    double run = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      x.push_back(kBox.lower[k] + (kBox.upper[k] - kBox.lower[k]) * unit(generator));
      y.push_back(kBox.lower[k] + (kBox.upper[k] - kBox.lower[k]) * unit(generator));
      run += (x[k] - y[k]) * (x[k] - y[k]);
    }
    std::vector<double> v = phi(x), w = phi(y);
    for (std::size_t k = 0; k < v.size(); ++k) {
      const double other = others(generator);
      v[k] += other, w[k] += other;
    }
    const double slope = std::abs(rho(v)[0] - rho(w)[0]) / std::sqrt(run);
    EXPECT_LE(slope, upper * (1 + 1e-9));
    closest = std::max(closest, slope / upper);
  }
  EXPECT_GT(closest, 0.3);
}

TEST(LocalBound, SteepCentresHaveTheSlopesThatDifferencesShow) {
  std::mt19937 generator(8);
  double closest = 0;
  for (int i = 0; i < 10; ++i) {
    const files::Network network = plain(tests::random_network({3, 8, 8, 2}, generator));
    const LocalChain chain = local_chain(reach_network(*network.plain), {}, {}, {});
    const LocalBound bound = local_bound(network, claim_of("network"), kBox, {}, boxes(200));
    ASSERT_FALSE(bound.steep_centres.empty());
    const files::Evaluator<double> f(*network.plain);
    double last = std::numeric_limits<double>::infinity();
    for (const Eigen::VectorXd& x : bound.steep_centres) {
      const double slope = std::sqrt(chain.unscaled_rho(chain.squared_slope(x)));
      EXPECT_LE(slope, last) << "steepest first";
      EXPECT_LE(slope, bound.upper.value());
      last = slope;
      const std::vector<double> at(x.data(), x.data() + x.size());
      for (int direction = 0; direction < 500; ++direction) {
        std::vector<double> to = at;
        double length = 0;
        for (double& coordinate : to) {
          const double step = 1e-6 * std::normal_distribution<double>()(generator);
          coordinate += step;
          length = std::hypot(length, step);
        }
        const std::vector<double> fx = f(at), fy = f(to);
        double rise = 0;
        for (std::size_t k = 0; k < fx.size(); ++k) rise = std::hypot(rise, fx[k] - fy[k]);
        EXPECT_LE(rise / length, slope * (1 + 1e-6));
        closest = std::max(closest, rise / length / slope);
      }
    }
  }
  EXPECT_GT(closest, 0.99) << "no direction came close to the steepest";
}

TEST(LocalBound, SurvivesNetworksThatNeverChange) {
  const files::Network constant = plain(weights({layer(2, 3, {0, 0, 0, 0, 0, 0}), layer(1, 2, {1, 1})}));
  EXPECT_LT(proved_on(constant, kBox, 5), 1e-6);
  const files::Network silent = plain(weights({layer(2, 3, {1, 2, 3, 4, 5, 6}), layer(1, 2, {0, 0})}));
  const LocalBound bound = local_bound(silent, claim_of("network"), kBox, {}, boxes(5));
  EXPECT_TRUE(!bound.proof || bound.upper.value() < 1e-6);  // no proof: the bound for all inputs is as good
}

TEST(LocalBound, OfABoxWithoutVolumeIsStillAbound) {
  std::mt19937 generator(8);
  const files::Network network = plain(tests::random_network({3, 6, 1}, generator));
  EXPECT_LE(proved_on(network, {{-1, 0.5, 0.2}, {1, 0.5, 0.2}}, 50),
            proved(tests::sdp_bound_of(network)) * (1 + 1e-6));
}

// --- the checker's part

TEST(NeuronBounds, ContainWhatEveryNeuronTakesInTheBox) {
  std::mt19937 generator(9);
  double tightest = 1e9;
  for (int i = 0; i < 20; ++i) {
    const files::Weights network = tests::random_network({3, 8, 7, 6, 1}, generator);
    const check::LocalFunction f =
        check::local_function(plain(network), "network", "all", {}, check::Matrix(0, 0));
    const check::NeuronBounds whole = check::neuron_bounds(f.hidden, kBox.lower, kBox.upper, nullptr);
    Box part = kBox;
    part.upper[0] = 0;
    const check::NeuronBounds half = check::neuron_bounds(f.hidden, part.lower, part.upper, &whole);
    for (int sample = 0; sample < 500; ++sample) {
      std::vector<double> h;
      for (std::size_t k = 0; k < 3; ++k)
        h.push_back(std::uniform_real_distribution<double>(part.lower[k], part.upper[k])(generator));
      for (std::size_t k = 0; k < f.hidden.size(); ++k) {
        std::vector<double> next;
        for (int row = 0; row < f.hidden[k].outputs; ++row) {
          double y = f.hidden[k].biases[static_cast<std::size_t>(row)];
          for (std::size_t j = 0; j < h.size(); ++j)
            y += f.hidden[k].weights[static_cast<std::size_t>(row) * h.size() + j] * h[j];
          for (const check::NeuronBounds* bounds : {&whole, &half}) {
            EXPECT_LE(bounds->lower[k][static_cast<std::size_t>(row)], y + 1e-12);
            EXPECT_GE(bounds->upper[k][static_cast<std::size_t>(row)], y - 1e-12);
          }
          tightest = std::min(tightest, half.upper[k][static_cast<std::size_t>(row)] - y);
          next.push_back(std::max(0.0, y));
        }
        h = std::move(next);
      }
    }
  }
  EXPECT_LT(tightest, 0.01) << "no sample came close to a bound";
}

struct Proved {
  files::Network network;
  check::LocalFunction function;
  LocalProof proof;
  bool accepts(const Box& box, double rho, const check::TreeProof& tree) const {
    return check::check_tree(function, box.lower, box.upper, rho, tree).holds;
  }
};

Proved example() {
  std::mt19937 generator(12);
  Proved made{plain(tests::random_network({3, 9, 9, 2}, generator)), {}, {}};
  made.function = check::local_function(made.network, "network", "all", {}, check::Matrix(0, 0));
  made.proof = *local_bound(made.network, claim_of("network"), kBox, {}, boxes(60)).proof;
  return made;
}

TEST(TreeProof, IsRefusedForALargerBoxAndForASmallerBound) {
  const Proved made = example();
  const LocalProof& proof = made.proof;
  ASSERT_TRUE(made.accepts(kBox, proof.rho, proof.tree));
  EXPECT_TRUE(made.accepts(kBox, proof.rho * 1.01, proof.tree));
  EXPECT_FALSE(made.accepts(kBox, proof.rho * (1 - 1e-6), proof.tree));
  EXPECT_FALSE(made.accepts(kBox, 0, proof.tree));
  EXPECT_FALSE(made.accepts(kBox, std::nan(""), proof.tree));
  EXPECT_FALSE(made.accepts({{-9, -9, -9}, {9, 9, 9}}, proof.rho, proof.tree));
}

TEST(TreeProof, IsRefusedWhereWordsOrMultipliersAreMissingOrWrong) {
  const Proved made = example();
  const LocalProof& proof = made.proof;
  const auto refused = [&](const std::string& text) {
    return !made.accepts(kBox, proof.rho, {text, proof.tree.multipliers});
  };
  const std::string& tree = proof.tree.tree;
  EXPECT_TRUE(refused(""));
  EXPECT_TRUE(refused(tree.substr(0, tree.rfind(' '))));
  EXPECT_TRUE(refused(tree + " t0"));
  EXPECT_TRUE(refused("t0")) << "the root's multipliers prove the whole box: the tree improved nothing";
  EXPECT_TRUE(refused("s7 t0 t0"));
  EXPECT_TRUE(refused("t99999"));
  for (const char* const text : {"s", "t", "x0", "s-1", "s0t0", "t99999999999999999999999", " ", "s0 "})
    EXPECT_TRUE(refused(text)) << text;
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "s0 ";
  EXPECT_TRUE(refused(deep + "t0"));

  check::TreeProof changed = proof.tree;
  for (std::vector<double>& t : changed.multipliers) t.front() = -1;
  EXPECT_FALSE(made.accepts(kBox, proof.rho, changed));
  changed = proof.tree;
  for (std::vector<double>& t : changed.multipliers) t.pop_back();
  EXPECT_FALSE(made.accepts(kBox, proof.rho, changed));
  int refused_multipliers = 0;
  for (std::size_t i = 0; i < proof.tree.multipliers.front().size(); ++i) {
    changed = proof.tree;
    for (std::vector<double>& t : changed.multipliers) t[i] *= 1.1;
    if (!made.accepts(kBox, proof.rho, changed)) ++refused_multipliers;
  }
  EXPECT_GE(refused_multipliers, 5) << "of " << proof.tree.multipliers.front().size();
}

TEST(TreeProof, UnderflowProvesNothing) {
  // 64 neurons that are on, slope 64 / 8 / 8 = 1, in units in which every product in the inequality underflows.
  const std::vector<double> eighths(64, 0.125), ones(64, 1.0);
  const files::Network network =
      plain(weights({{"fc1", 64, 1, eighths, ones}, {"fc2", 1, 64, eighths, {0}}}));
  check::LocalFunction f = check::local_function(network, "network", "all", {}, check::Matrix(0, 0));
  const check::TreeProof tree{"t0", {std::vector<double>(64, 0.0)}};
  ASSERT_TRUE(check::check_tree(f, {0}, {1}, 1 + 1e-9, tree).holds);
  ASSERT_FALSE(check::check_tree(f, {0}, {1}, 1 - 1e-9, tree).holds);
  for (const int exponent : {-100, -180, -200, -201, -535}) {
    f.weight = {std::ldexp(1.0, exponent)};
    EXPECT_FALSE(check::check_tree(f, {0}, {1}, std::ldexp(0.25, 2 * exponent), tree).holds) << exponent;
  }
}

TEST(TreeProof, IsRefusedForBoxesThatAreNone) {
  const Proved made = example();
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  for (const Box& box : {Box{{1, 1, 1}, {0, 0, 0}}, Box{{0, 0}, {1, 1}}, Box{{0, 0, nan}, {1, 1, 1}},
                         Box{{0, 0, -infinity}, {1, 1, 1}}, Box{{0, 0, 0}, {1, 1, 1e200}}})
    EXPECT_FALSE(made.accepts(box, made.proof.rho, made.proof.tree));
}

// --- the published networks

/// The lower bounds are exact slopes between points of the box found by a separate search.
TEST(LocalBoundPublishedNetwork, OfTheGroundIsWithinFourPercentOfAnAttainedSlope) {
  SWARMCERT_NEEDS_DATA();
  const files::Network network = plain(files::load_weights(tests::data_path("weights/zip_f32/phi_G.pth")));
  const double upper = proved_on(network, {{-1, -2, -2, -2}, {1, 2, 2, 2}}, 10000, "network", 14.8059);
  EXPECT_GE(upper, 14.8059);
  EXPECT_LE(upper, 1.04 * 14.8059);
}

}  // namespace
}  // namespace swarmcert::lipschitz

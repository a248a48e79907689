/// Neurons decided by better lower slopes: their decisions are true, and decisions that are not proved are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "lipschitz/branch/local_bound.h"
#include "lipschitz/checker/box_states.h"
#include "lipschitz/checker/tree_proof.h"
#include "lipschitz/checker/tree_words.h"
#include "lipschitz/networks.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

const std::string kWholeSet = "set:default:default";

Box random_box(std::mt19937& generator) {
  std::uniform_real_distribution<double> centre(-1, 1), width(0.05, 0.5);
  Box box;
  for (int k = 0; k < 3; ++k) {
    box.lower.push_back(centre(generator));
    box.upper.push_back(box.lower.back() + width(generator));
  }
  return box;
}

/// Returns y of a neuron, numbered over all outputs.
double neuron_at(const ReachNetwork& network, const VectorXd& x, std::size_t neuron) {
  VectorXd h = x;
  for (const ReachLayer& layer : network) {
    h = (layer.weights * h + layer.bias).eval();
    if (neuron < static_cast<std::size_t>(h.size())) return h(static_cast<Index>(neuron));
    neuron -= static_cast<std::size_t>(h.size());
    h = h.cwiseMax(0.0);
  }
  return std::nan("");
}

/// Returns the largest sign * y in the box found by climbing from random points and all corners.
double largest_found(const ReachNetwork& network, const Box& box, std::size_t neuron, double sign,
                     std::mt19937& generator) {
  std::uniform_real_distribution<double> unit(0, 1);
  const auto inputs = static_cast<Index>(box.lower.size());
  const Eigen::Map<const VectorXd> lower(box.lower.data(), inputs), upper(box.upper.data(), inputs);
  double best = -1e300;
  for (int start = 0; start < 16; ++start) {
    VectorXd x(inputs);
    for (Index k = 0; k < inputs; ++k) {
      const double at = start < 8 ? static_cast<double>(start >> k & 1) : unit(generator);
      x(k) = lower(k) + at * (upper(k) - lower(k));
    }
    double value = sign * neuron_at(network, x, neuron);
    for (double step = 0.5; step > 1e-3; step *= 0.8) {
      VectorXd next = x;
      for (Index k = 0; k < inputs; ++k) next(k) += step * (2 * unit(generator) - 1) * (upper(k) - lower(k));
      next = next.cwiseMax(lower).cwiseMin(upper);
      const double there = sign * neuron_at(network, next, neuron);
      if (there > value) value = there, x = next;
    }
    best = std::max(best, value);
  }
  return best;
}

int undecided(const Reach& reach, std::size_t layers) {
  int count = 0;
  for (std::size_t k = 0; k < layers; ++k)
    for (Index i = 0; i < reach.before_relu(k).lower.size(); ++i)
      if (reach.before_relu(k).lower(i) < 0 && reach.before_relu(k).upper(i) > 0) ++count;
  return count;
}

TEST(Decisions, AreTrueAtEveryPointOfTheBoxThatASearchFinds) {
  std::mt19937 generator(31);
  int decisions = 0;
  double nearest = -1e300;
  for (int i = 0; i < 300; ++i) {
    const ReachNetwork network = reach_network(tests::random_network({3, 8, 8, 8, 1}, generator));
    const Box box = random_box(generator);
    std::vector<check::Decision> decided;
    const Reach reach(network, box, nullptr, nullptr, nullptr, &decided);
    for (const check::Decision& decision : decided) {
      const double found = largest_found(network, box, decision.neuron, decision.is_on ? -1 : 1, generator);
      EXPECT_LE(found, 0) << "neuron " << decision.neuron;
      nearest = std::max(nearest, found);
      ++decisions;
    }
  }
  std::printf("%d decisions, nearest value to zero %.2g\n", decisions, nearest);
  EXPECT_GT(decisions, 50);
  EXPECT_GT(nearest, -0.02) << "no point came close to a bound: the search tests nothing";
}

TEST(Decisions, LeaveNoNeuronOpenThatIsDecidedWithoutThem) {
  std::mt19937 generator(32);
  int with = 0, without = 0;
  for (int i = 0; i < 300; ++i) {
    const ReachNetwork network = reach_network(tests::random_network({3, 8, 8, 8, 1}, generator));
    const Box box = random_box(generator);
    std::vector<check::Decision> decided;
    const Reach better(network, box, nullptr, nullptr, nullptr, &decided), plain(network, box);
    const int open = undecided(better, 3);
    EXPECT_LE(open + static_cast<int>(decided.size()), undecided(plain, 3));
    with += open;
    without += undecided(plain, 3);
  }
  std::printf("undecided: %d with better slopes, %d without\n", with, without);
  EXPECT_LT(with + 20, without);
}

TEST(Decisions, OfTheCheckerAreThoseOfTheSearchAndNoOther) {
  std::mt19937 generator(33);
  int held = 0, refused = 0;
  for (int i = 0; i < 200; ++i) {
    const files::Weights weights = tests::random_network({3, 8, 8, 8, 1}, generator);
    const ReachNetwork network = reach_network(weights);
    const check::LocalFunction f =
        check::local_function(tests::plain(weights), "network", "all", {}, check::Matrix(0, 0));
    const Box box = random_box(generator);
    const auto hold = [&](const std::vector<check::Decision>& decisions) {
      check::NeuronBounds bounds;
      return check::add_layers(bounds, f.hidden, box.lower, box.upper, nullptr, decisions);
    };
    std::vector<check::Decision> decided;
    const Reach reach(network, box, nullptr, nullptr, nullptr, &decided);
    EXPECT_TRUE(hold(decided));
    held += static_cast<int>(decided.size());
    for (check::Decision decision : decided) {
      decision.is_on = !decision.is_on;
      EXPECT_FALSE(hold({decision})) << "neuron " << decision.neuron;
    }
    for (std::size_t neuron = 8; neuron < 24; ++neuron) {  // neurons on at one point, off at another
      if (!(largest_found(network, box, neuron, 1, generator) > 0)) continue;
      if (!(largest_found(network, box, neuron, -1, generator) > 0)) continue;
      for (std::uint64_t corner = 0; corner < 8; ++corner)
        for (const bool is_on : {true, false}) {
          EXPECT_FALSE(hold({{neuron, is_on, corner}}));
          ++refused;
        }
    }
  }
  EXPECT_GT(held, 30);
  EXPECT_GT(refused, 1000);
}

struct Searched {
  LocalProof proof;
  check::LocalFunction function;
  Box box;
  bool accepts(const check::TreeProof& tree) const {
    return check::check_tree(function, box.lower, box.upper, proof.rho, tree).holds;
  }
};

Searched searched(bool is_set) {
  std::mt19937 generator(34);
  Searched made;
  made.box = {{-1, -1, -1}, {1, 1, 1}};
  Claim claim;
  claim.domain = "box";
  BranchOptions options;
  options.nodes = 600;  // too many boxes at the end for a second solution, which would add conflicts
  files::Network network;
  if (is_set) {
    network = tests::deep_set(tests::random_network({3, 10, 10, 4}, generator),
                              tests::random_network({4, 12, 12, 1}, generator));
    claim.function = kWholeSet;
    claim.neighbours = {{"default", 1}};
    const std::vector<double> nothing(12, 0.0);
    made.function = check::coupled_function(network, kWholeSet, "all", {}, nothing, nothing);
  } else {
    network = tests::plain(tests::random_network({3, 12, 12, 12, 2}, generator));
    claim.function = "network";
    made.function = check::local_function(network, "network", "all", {}, check::Matrix(0, 0));
  }
  const std::vector<double> t = tests::sdp_bound_of(network, claim.function).proof->t;
  const std::string part = is_set ? "phi:default" : "network";
  const LocalBound bound = local_bound(network, claim, {{part, made.box}}, t, options);
  made.proof = bound.proof.value();
  const LocalBound again = local_bound(network, claim, {{part, made.box}}, t, options);
  EXPECT_EQ(made.proof.tree.tree, again.proof->tree.tree);
  EXPECT_EQ(made.proof.rho, again.proof->rho);
  return made;
}

std::vector<check::Word> words_in(const std::string& tree) {
  std::vector<check::Word> result(1);
  for (check::Words words(tree); words.are_left() && words.read(result.back());) result.emplace_back();
  result.pop_back();
  return result;
}

TEST(Decisions, OfATreeAreRefusedOnceTheyAreChangedOrMisplaced) {
  for (const bool is_set : {false, true}) {
    const Searched made = searched(is_set);
    const std::string& tree = made.proof.tree.tree;
    ASSERT_TRUE(made.accepts(made.proof.tree));
    int flipped = 0, without = 0;
    for (std::size_t at = tree.find('d'); at != std::string::npos && flipped < 20;
         at = tree.find('d', at + 1)) {
      check::TreeProof changed = made.proof.tree;
      const std::size_t sign = tree.find_first_of("+-", at);
      changed.tree[sign] = tree[sign] == '+' ? '-' : '+';
      EXPECT_FALSE(made.accepts(changed)) << "sign at " << at;
      ++flipped;
      changed.tree = tree.substr(0, at) + tree.substr(tree.find(' ', at) + 1);
      if (!made.accepts(changed)) ++without;
    }
    std::printf("%d decisions flipped; %d needed\n", flipped, without);
    EXPECT_GT(flipped, 10);
    EXPECT_GT(without, 0) << "no part needs the decisions";
    for (const char* const word :
         {"d", "d9", "d9+", "d+5", "d9x5", "d9+5x", "d999+0", "d-1+0", "d9+9999999999999999"}) {
      check::TreeProof changed = made.proof.tree;
      changed.tree = std::string(word) + " " + tree;
      EXPECT_FALSE(made.accepts(changed)) << word;
    }
    check::TreeProof changed = made.proof.tree;
    changed.tree += " d9+5";
    EXPECT_FALSE(made.accepts(changed)) << "behind the last part";
  }
}

TEST(Tree, HasNoMultipliersAndNoFormsThatNoLeafUses) {
  for (const bool is_set : {false, true}) {
    const Searched made = searched(is_set);
    std::set<std::size_t> multipliers, forms;
    for (const check::Word& word : words_in(made.proof.tree.tree)) {
      if (word.kind == 't') multipliers.insert(word.index);
      if (word.kind == 'q') forms.insert(word.index);
    }
    EXPECT_EQ(multipliers.size(), made.proof.tree.multipliers.size());
    EXPECT_EQ(forms.size(), made.proof.tree.forms.size());
    EXPECT_EQ(*multipliers.rbegin() + 1, multipliers.size());
    EXPECT_EQ(is_set, !forms.empty());
    EXPECT_TRUE(made.proof.tree.conflicts.empty());
    check::TreeProof longer = made.proof.tree;  // unused entries are harmless
    longer.multipliers.push_back(longer.multipliers.front());
    if (is_set) longer.forms.push_back(longer.forms.front());
    EXPECT_TRUE(made.accepts(longer));
  }
}

}  // namespace
}  // namespace swarmcert::lipschitz

// Maxima of networks over a box: never below a value, close to the exact maximum, independent of the number of threads.
#include "lipschitz/values/extremes.h"

#include <gtest/gtest.h>

#include <random>

#include "lipschitz/networks.h"
#include "lipschitz/values/range.h"
#include "lipschitz/values/sum_support.h"
#include "nn/base/random.h"

namespace swarmcert {
namespace {

using Eigen::RowVectorXd;
using Eigen::VectorXd;
using lipschitz::Box;
using lipschitz::Maximum;

const Box kUnitBox{{-1, -1, -1}, {1, 1, 1}};

VectorXd point_in(const Box& box, files::Random& random) {
  VectorXd x(static_cast<Eigen::Index>(box.lower.size()));
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    x(k) = box.lower[i] + random.uniform() * (box.upper[i] - box.lower[i]);
  }
  return x;
}

/// |x1| + |x2 - 1/2| - |x3| written with six ReLUs; its maximum over [-1, 1]^3 is 1 + 3/2 - 0.
lipschitz::ReachNetwork sum_of_absolute_values() {
  lipschitz::ReachLayer first{Eigen::MatrixXd::Zero(6, 3), VectorXd::Zero(6), VectorXd::Zero(6), true};
  for (int k = 0; k < 3; ++k) first.weights(2 * k, k) = 1, first.weights(2 * k + 1, k) = -1;
  first.bias(2) = -0.5;
  first.bias(3) = 0.5;
  lipschitz::ReachLayer last{Eigen::MatrixXd::Zero(1, 6), VectorXd::Zero(1), VectorXd::Zero(1), false};
  last.weights << 1, 1, 1, 1, -1, -1;
  return {first, last};
}

TEST(Extremes, FindTheMaximumThatIsKnown) {
  const Maximum found =
      lipschitz::maximise(sum_of_absolute_values(), RowVectorXd::Ones(1), kUnitBox, {400, 1e-6, 1});
  EXPECT_GE(found.upper, 2.5);
  EXPECT_LE(found.upper, 2.5 * (1 + 1e-5));
  EXPECT_NEAR(found.value, 2.5, 1e-5);
}

TEST(Extremes, NoValueIsAboveTheBoundAndMoreBoxesBringItCloser) {
  std::mt19937 generator(11);
  int closer = 0;
  for (int round = 0; round < 8; ++round) {
    const lipschitz::ReachNetwork network =
        lipschitz::reach_network(tests::random_network({3, 12, 12, 1}, generator));
    const Maximum few = lipschitz::maximise(network, RowVectorXd::Ones(1), kUnitBox, {1, 1e-6, 1});
    const Maximum many = lipschitz::maximise(network, RowVectorXd::Ones(1), kUnitBox, {400, 1e-6, 2});
    EXPECT_LE(many.upper, few.upper);
    closer += many.upper - many.value < 0.2 * (few.upper - many.value);
    files::Random random(static_cast<std::uint64_t>(round));
    for (int sample = 0; sample < 2000; ++sample)
      ASSERT_LE(lipschitz::evaluate_roughly(network, point_in(kUnitBox, random))(0), many.upper + 1e-12);
  }
  EXPECT_GE(closer, 6);
}

TEST(Extremes, DoNotDependOnTheNumberOfThreads) {
  std::mt19937 generator(12);
  const lipschitz::ReachNetwork network =
      lipschitz::reach_network(tests::random_network({3, 16, 16, 16, 1}, generator));
  const Maximum one = lipschitz::maximise(network, RowVectorXd::Ones(1), kUnitBox, {301, 1e-6, 1});
  const Maximum four = lipschitz::maximise(network, RowVectorXd::Ones(1), kUnitBox, {301, 1e-6, 4});
  EXPECT_EQ(one.upper, four.upper);
  EXPECT_EQ(one.value, four.value);
  EXPECT_EQ(one.nodes, four.nodes);
  EXPECT_GT(one.nodes, 100);
}

TEST(Extremes, FormsOverSumsAreNotBelowAnySumOfOutputs) {
  std::mt19937 generator(13);
  const lipschitz::ReachNetwork phi = lipschitz::reach_network(tests::random_network({3, 8, 4}, generator));
  const lipschitz::ReachNetwork ground =
      lipschitz::reach_network(tests::random_network({3, 6, 4}, generator));
  lipschitz::PartTree phi_tree(phi, kUnitBox), ground_tree(ground, kUnitBox);
  const lipschitz::SumSupport support{{{&phi_tree, 3}, {&ground_tree, 1}}, 4, {64, 0.01, 1}};
  const lipschitz::LinearForms forms{Eigen::MatrixXd::Random(5, 4), VectorXd::Random(5)};
  const VectorXd bound = support(forms);
  VectorXd largest = VectorXd::Constant(5, -1e300);
  files::Random random(1);
  for (int sample = 0; sample < 20000; ++sample) {
    VectorXd sum = lipschitz::evaluate_roughly(ground, point_in(kUnitBox, random));
    for (int j = 0; j < 3; ++j) sum += lipschitz::evaluate_roughly(phi, point_in(kUnitBox, random));
    largest = largest.cwiseMax(forms.rows * sum + forms.constants);
  }
  for (int i = 0; i < 5; ++i) EXPECT_LE(largest(i), bound(i) + 1e-12) << i;
  // The bounding box of the sums alone would give much larger bounds.
  const lipschitz::Bounds box = support.bounds();
  const VectorXd from_box =
      forms.rows.cwiseMax(0.0) * box.upper + forms.rows.cwiseMin(0.0) * box.lower + forms.constants;
  EXPECT_LT(bound.sum(), from_box.sum());
}

TEST(Extremes, TheJumpOfASingleNeighbourIsTheDifferenceThatItMakes) {
  std::mt19937 generator(14);
  const files::Network network = tests::deep_set(tests::random_network({3, 8, 4}, generator),
                                                 tests::random_network({4, 8, 1}, generator));
  const auto found = lipschitz::ranges(network, {{"phi:default", kUnitBox}}, {{"default", 1e6}}, {});
  ASSERT_EQ(found.size(), 1u);
  const lipschitz::ReachNetwork rho = lipschitz::reach_network(network.rho.at("default"));
  const double alone = lipschitz::evaluate_roughly(rho, VectorXd::Zero(4))(0);
  const double attained = std::max(found[0].greatest.value - alone, alone - found[0].least.value);
  EXPECT_GE(found[0].jump, attained - 1e-12);
  EXPECT_LE(found[0].jump, 1.05 * attained);
}

}  // namespace
}  // namespace swarmcert

// Maxima of many forms over one tree of parts: equal to those of Reach if nothing is halved, never below a value, close
// to the largest value found, independent of previous queries and of the number of threads.
#include "lipschitz/values/part_tree.h"

#include <gtest/gtest.h>

#include <random>

#include "lipschitz/networks.h"
#include "nn/base/random.h"

namespace swarmcert {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using lipschitz::LargestValues;
using lipschitz::PartTree;
using lipschitz::ReachNetwork;

const lipschitz::Box kHalvedCube{{-1, -1, -1}, {1, 1, 1}};

ReachNetwork network(unsigned seed) {
  std::mt19937 generator(seed);
  return lipschitz::reach_network(tests::random_network({3, 14, 14, 5}, generator));
}

TEST(PartTree, UndividedItBoundsFormsAsReachDoes) {
  const ReachNetwork phi = network(31);
  const lipschitz::Reach whole(phi, kHalvedCube);
  PartTree tree(phi, kHalvedCube);
  const MatrixXd forms = MatrixXd::Random(7, 5);
  const VectorXd expected = whole.largest(whole.upper_forms(forms));
  const LargestValues found = tree.largest(forms, {0, 0, 1});
  for (Index i = 0; i < forms.rows(); ++i) EXPECT_NEAR(found.upper(i), expected(i), 1e-9) << i;
}

TEST(PartTree, NoValueIsAboveABoundAndHalvedPartsBringItClose) {
  int close = 0, forms_seen = 0;
  for (unsigned seed = 0; seed < 4; ++seed) {
    const ReachNetwork phi = network(seed);
    PartTree tree(phi, kHalvedCube);
    const MatrixXd forms = MatrixXd::Random(6, 5);
    const LargestValues whole = tree.largest(forms, {0, 0, 1}), halved = tree.largest(forms, {800, 0.001, 2});
    for (Index i = 0; i < forms.rows(); ++i) {
      EXPECT_LT(halved.upper(i), whole.upper(i));  // halving parts improved the bound
      EXPECT_GE(halved.upper(i), halved.value(i));
      EXPECT_NEAR(halved.value(i), forms.row(i) * lipschitz::evaluate_roughly(phi, halved.x.col(i)), 1e-12);
      close += halved.upper(i) - halved.value(i) < 0.05 * (whole.upper(i) - halved.value(i));
      ++forms_seen;
    }
    files::Random random(seed);
    for (int sample = 0; sample < 3000; ++sample) {
      VectorXd x(3);
      for (double& coordinate : x) coordinate = random.symmetric();
      const VectorXd values = forms * lipschitz::evaluate_roughly(phi, x);
      for (Index i = 0; i < forms.rows(); ++i) ASSERT_LE(values(i), halved.upper(i) + 1e-12);
    }
  }
  EXPECT_GE(close, forms_seen - 2);
}

TEST(PartTree, BoundsDoNotDependOnThreadsAndGoOnWhereASearchEnded) {
  const ReachNetwork phi = network(32);
  const MatrixXd forms = MatrixXd::Random(5, 5);
  PartTree one(phi, kHalvedCube), four(phi, kHalvedCube);
  const LargestValues first = one.largest(forms, {30, 0.001, 1});
  EXPECT_EQ(first.upper, four.largest(forms, {30, 0.001, 4}).upper);
  EXPECT_EQ(first.upper, one.largest(forms, {30, 0.001, 1}).upper);
  const LargestValues more = one.largest(forms, {900, 0.001, 1});
  EXPECT_LT(more.upper.sum(), first.upper.sum());
  for (Index i = 0; i < forms.rows(); ++i) EXPECT_LE(more.upper(i), first.upper(i));
}

TEST(PartTree, FormsThatAreNoNumbersHaveNoBound) {
  const ReachNetwork phi = network(33);
  PartTree tree(phi, kHalvedCube);
  MatrixXd forms = MatrixXd::Random(2, 5);
  forms(1, 3) = std::numeric_limits<double>::quiet_NaN();
  const VectorXd upper = tree.largest(forms, {10, 0.01, 1}).upper;
  EXPECT_LT(upper(0), 1e6);
  EXPECT_EQ(upper(1), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace swarmcert

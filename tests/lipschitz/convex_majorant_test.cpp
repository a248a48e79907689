// The convex upper bound of a function of a sum: above the function for any neighbours, tight at the requested point.
#include "lipschitz/values/convex_majorant.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "lipschitz/networks.h"
#include "lipschitz/values/extremes.h"
#include "nn/base/random.h"

namespace swarmcert {
namespace {

using Eigen::RowVectorXd;
using Eigen::VectorXd;
using lipschitz::ReachNetwork;

const lipschitz::Box kPlace{{-1, -1, -1}, {1, 1, 1}};
constexpr double kRounding = 1e-9;

VectorXd anywhere(files::Random& random) {
  VectorXd x(3);
  for (double& coordinate : x) coordinate = random.symmetric();
  return x;
}

TEST(ConvexMajorant, OneNeighbourOfItIsAboveAnyNeighboursOfTheFunctionAndTightWhereItTouches) {
  std::mt19937 generator(41);
  files::Random random(42);
  int alike_is_less = 0, above = 0;
  for (int round = 0; round < 12; ++round) {
    const ReachNetwork phi = lipschitz::reach_network(tests::random_network({3, 9, 4}, generator));
    const ReachNetwork rho = lipschitz::reach_network(tests::random_network({4, 10, 8, 7, 1}, generator));
    const int n = 2 + round % 4;
    const RowVectorXd direction = RowVectorXd::Constant(1, round % 2 == 0 ? 1.0 : -1.0);
    const auto f = [&](const VectorXd& sum) { return direction.dot(lipschitz::evaluate_roughly(rho, sum)); };
    const VectorXd touching = anywhere(random);
    const VectorXd touched = n * lipschitz::evaluate_roughly(phi, touching);
    const ReachNetwork network = lipschitz::convex_majorant(phi, kPlace, n, rho, direction, touched);
    const auto r = [&](const VectorXd& x) { return lipschitz::evaluate_roughly(network, x)(0); };
    EXPECT_NEAR(r(touching), f(touched), kRounding);
    const double bound = lipschitz::maximise(network, RowVectorXd::Ones(1), kPlace, {200, 1e-3, 1}).upper;
    for (const lipschitz::ReachLayer& layer : network) EXPECT_LT(layer.bias_radius.maxCoeff(), kRounding);
    for (int sample = 0; sample < 2000; ++sample) {
      VectorXd sum = VectorXd::Zero(4);
      double one = -1e300, alike = -1e300;
      for (int j = 0; j < n; ++j) {
        const VectorXd x = anywhere(random), term = lipschitz::evaluate_roughly(phi, x);
        sum += term;
        one = std::max(one, r(x));
        alike = std::max(alike, f(n * term));
        above += r(x) > f(n * term) + 1e-3;
        ASSERT_GE(r(x), f(n * term) - kRounding);
      }
      ASSERT_LE(f(sum), one + kRounding);
      ASSERT_LE(f(sum), bound + kRounding);
      alike_is_less += f(sum) > alike + 1e-3;
    }
  }
  // The same does not hold for f itself, and the majorant differs from f.
  EXPECT_GT(alike_is_less, 100);
  EXPECT_GT(above, 1000);
}

TEST(ConvexMajorant, OfARhoWithoutHiddenLayersIsRhoOfTheMultiple) {
  std::mt19937 generator(43);
  files::Random random(44);
  const ReachNetwork phi = lipschitz::reach_network(tests::random_network({3, 6, 4}, generator));
  const ReachNetwork rho = lipschitz::reach_network(tests::random_network({4, 1}, generator));
  const ReachNetwork network =
      lipschitz::convex_majorant(phi, kPlace, 3, rho, RowVectorXd::Constant(1, -1), VectorXd::Zero(4));
  for (int sample = 0; sample < 100; ++sample) {
    const VectorXd x = anywhere(random);
    EXPECT_NEAR(lipschitz::evaluate_roughly(network, x)(0),
                -lipschitz::evaluate_roughly(rho, 3 * lipschitz::evaluate_roughly(phi, x))(0), kRounding);
  }
}

}  // namespace
}  // namespace swarmcert

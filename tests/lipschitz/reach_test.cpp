// Linear bounds of ReLU networks over a box: equal to plain backward substitution, and never below a value.
#include "lipschitz/values/reach.h"

#include <gtest/gtest.h>

#include <random>

#include "lipschitz/networks.h"
#include "lipschitz/values/extremes.h"
#include "nn/base/random.h"

namespace swarmcert {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using lipschitz::Bounds;
using lipschitz::Reach;
using lipschitz::ReachNetwork;

const lipschitz::Box kCube{{-1, -1, -1}, {1, 1, 1}};

/// Returns the largest value over kCube of an upper bound on lambda y_top, without regard to round-off and without
/// removing neurons.
double substituted(const ReachNetwork& network, const std::vector<Bounds>& bounds, std::size_t top,
                   VectorXd lambda) {
  double constant = 0;
  for (std::size_t j = top + 1; j-- > 0;) {
    constant += lambda.dot(network[j].bias) + lambda.cwiseAbs().dot(network[j].bias_radius);
    lambda = (network[j].weights.transpose() * lambda).eval();
    if (j == 0 || !network[j - 1].has_relu) continue;
    for (Eigen::Index i = 0; i < lambda.size(); ++i) {
      const double l = bounds[j - 1].lower(i), u = bounds[j - 1].upper(i);
      if (l >= 0) continue;
      if (u <= 0) {
        lambda(i) = 0;
      } else if (lambda(i) > 0) {
        constant += lambda(i) * u * -l / (u - l);
        lambda(i) *= u / (u - l);
      } else if (u <= -l) {
        lambda(i) = 0;
      }
    }
  }
  return constant + lambda.cwiseAbs().sum();
}

TEST(Reach, BoundsAreThoseOfPlainBackwardSubstitution) {
  std::mt19937 generator(21);
  for (int round = 0; round < 5; ++round) {
    ReachNetwork network = lipschitz::reach_network(tests::random_network({3, 9, 12, 7, 5, 2}, generator));
    network[2].has_relu = false;  // as between phi and rho
    network[2].bias_radius.setConstant(0.25);
    const Reach reach(network, kCube);
    std::vector<Bounds> bounds;
    int undecided = 0;
    for (std::size_t k = 0; k < network.size(); ++k) {
      const auto size = network[k].bias.size();
      Bounds expected{VectorXd(size), VectorXd(size)};
      for (Eigen::Index i = 0; i < size; ++i) {
        const VectorXd unit = VectorXd::Unit(size, i);
        expected.upper(i) = substituted(network, bounds, k, unit);
        expected.lower(i) = -substituted(network, bounds, k, -unit);
        undecided += network[k].has_relu && expected.lower(i) < 0 && expected.upper(i) > 0;
        EXPECT_NEAR(reach.before_relu(k).upper(i), expected.upper(i), 1e-9);
        EXPECT_NEAR(reach.before_relu(k).lower(i), expected.lower(i), 1e-9);
        // Round-off only widens the bounds.
        EXPECT_GE(reach.before_relu(k).upper(i), expected.upper(i) - 1e-14);
      }
      bounds.push_back(reach.before_relu(k));
    }
    EXPECT_GT(undecided, 5);
    const MatrixXd directions = MatrixXd::Random(3, 2);
    const VectorXd largest = reach.largest(reach.upper_forms(directions));
    for (Eigen::Index r = 0; r < 3; ++r)
      EXPECT_NEAR(largest(r), substituted(network, bounds, network.size() - 1, directions.row(r)), 1e-8);
  }
}

TEST(Reach, NoLayerLeavesItsBoundsOnABoxOrOnAPartOfIt) {
  std::mt19937 generator(22);
  const ReachNetwork network = lipschitz::reach_network(tests::random_network({3, 10, 10, 10, 1}, generator));
  const Reach whole(network, kCube);
  const Reach part(network, lipschitz::halves(kCube, 1).second, &whole);
  files::Random random(3);
  for (int sample = 0; sample < 3000; ++sample) {
    VectorXd h(3);
    for (double& x : h) x = random.symmetric();
    const bool in_part = h(1) >= 0;
    for (std::size_t k = 0; k < network.size(); ++k) {
      h = (network[k].weights * h + network[k].bias).eval();
      for (const Reach* const reach : {&whole, &part}) {
        if (reach == &part && !in_part) continue;
        ASSERT_TRUE((h.array() <= reach->before_relu(k).upper.array() + 1e-12).all());
        ASSERT_TRUE((h.array() >= reach->before_relu(k).lower.array() - 1e-12).all());
      }
      if (network[k].has_relu) h = h.cwiseMax(0.0);
    }
  }
  EXPECT_LE(part.output().upper(0), whole.output().upper(0));
}

}  // namespace
}  // namespace swarmcert

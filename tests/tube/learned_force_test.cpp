// Linear bounds of the network compared with the force in the simulator.
#include "analysis/tracking/tube/learned_force.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nn/base/input_error.h"
#include "nn/weights/functions.h"
#include "stability/effects/deep_set_force.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

using stability::DeepSetForce;
using stability::Instant;
using stability::Neighbour;
using tests::between;

double flown(DeepSetForce& force, const Eigen::VectorXd& x, int neighbours) {
  std::vector<Neighbour> others;
  for (int n = 0; n < neighbours; ++n) {
    others.push_back({x.segment<3>(n * kPerNeighbour), x.segment<3>(n * kPerNeighbour + 3),
                      Eigen::Vector3d::Zero(), 0.034, 0});
  }
  Instant now;
  now.p_W_m.z() = x(neighbours * kPerNeighbour);
  now.v_W_m_s = x.tail<3>();
  now.neighbours = others.data();
  now.num_neighbours = neighbours;
  return force.force_z_N(now);
}

void expect_enclosed(const files::Network& network, int neighbours, std::uint64_t seed) {
  const LearnedForce learned(network, "small", neighbours);
  DeepSetForce force(network, "small", {"small"});
  files::Random random(seed);
  const int size = state_size(neighbours);
  ASSERT_EQ(learned.states(), size);
  double largest = 0;
  for (int b = 0; b < 20; ++b) {
    lipschitz::Box box, part;
    const double width = std::pow(10, between(random, -3, -0.5));
    for (int k = 0; k < size; ++k) {
      const double centre = between(random, -0.5, 0.5);
      box.lower.push_back(centre - width);
      box.upper.push_back(centre + width);
      part.lower.push_back(centre - width / 2);
      part.upper.push_back(centre + width);
    }
    const LearnedForce::Forms whole = learned.over(box, nullptr);
    const LearnedForce::Forms inner = learned.over(part, &whole);
    for (int i = 0; i < 200; ++i) {
      Eigen::VectorXd x(size);
      for (int k = 0; k < size; ++k) {
        const auto at = static_cast<std::size_t>(k);
        x(k) = i % 4 == 0 ? (random.below(2) == 0 ? part.lower[at] : part.upper[at])
                          : between(random, part.lower[at], part.upper[at]);
      }
      const double f = flown(force, x, neighbours);
      ASSERT_NEAR(learned.roughly(x), f, 1e-12);
      largest = std::max(largest, std::abs(f));
      for (const LearnedForce::Forms* forms : {&whole, &inner}) {
        ASSERT_LE(f, forms->upper_row.dot(x) + forms->upper + 1e-13);
        ASSERT_LE(-f, forms->lower_row.dot(x) + forms->lower + 1e-13);
      }
    }
    // The linear bounds over a narrow box are close to each other.
    const double gap =
        (whole.upper_row + whole.lower_row).cwiseAbs().sum() * width +
        std::abs(
            (whole.upper_row + whole.lower_row)
                .dot((Eigen::Map<const Eigen::VectorXd>(box.lower.data(), size).array() + width).matrix()) +
            whole.upper + whole.lower);
    if (width < 2e-3) {
      EXPECT_LT(gap, 0.05);
    }
  }
  EXPECT_GT(largest, 0.01) << "the boxes must meet a force";
}

TEST(LearnedForce, LiesBetweenItsFormsForOneToThreeNeighbours) {
  for (int n = 1; n <= 3; ++n) expect_enclosed(tests::demo_network(), n, static_cast<std::uint64_t>(n));
}

TEST(LearnedForce, LiesBetweenItsFormsBeyondTheClampAndInAnyOrderOfInputs) {
  files::Network network = tests::demo_network();
  network.clamp = files::InputClamp{{-0.3, -0.3, -0.2, -0.1, -0.5, -0.4}, {0.2, 0.3, 0.4, 0.3, 0.1, 0.4}};
  expect_enclosed(network, 2, 11);
  network.input_order = {"dp_z_m", "dp_x_m", "dv_x_m_s", "dp_y_m", "dv_z_m_s", "dv_y_m_s"};
  expect_enclosed(network, 2, 12);
}

TEST(LearnedForce, LiesBetweenItsFormsWithAGroundOfAnotherDepth) {
  files::Network network = tests::demo_network();
  files::Weights ground;
  files::Random random(3);
  const int widths[] = {files::kGroundInputs, 7, network.phi.begin()->second.outputs()};
  for (int k = 0; k < 2; ++k) {
    files::Layer layer;
    layer.name = "fc" + std::to_string(k + 1);
    layer.inputs = widths[k];
    layer.outputs = widths[k + 1];
    for (int i = 0; i < layer.inputs * layer.outputs; ++i) layer.weights.push_back(random.symmetric());
    for (int i = 0; i < layer.outputs; ++i) layer.biases.push_back(random.symmetric());
    ground.layers.push_back(layer);
  }
  network.phi[files::kGroundKind] = ground;
  expect_enclosed(network, 2, 13);
}

// Simulation, models and a tube use it if the neighbours stay the same.
TEST(DeepSetForce, IsZeroInASilentCompositionAlsoOfNeighboursThatFadeAndInATube) {
  files::Network network = tests::demo_network();
  DeepSetForce always(network, "small", {"small"});
  network.silent["small"] = {{"small", "small"}};
  DeepSetForce force(network, "small", {"small"});
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(state_size(3), -0.3, 0.4);
  for (int n = 0; n <= 3; ++n) {
    const Eigen::VectorXd some = x.tail(state_size(n));
    EXPECT_EQ(flown(force, some, n), n == 2 ? 0 : flown(always, some, n)) << n;
  }
  std::vector<Neighbour> two;
  for (int n = 0; n < 2; ++n)
    two.push_back({x.segment<3>(n * kPerNeighbour), x.segment<3>(n * kPerNeighbour + 3),
                   Eigen::Vector3d::Zero(), 0.034, 0});
  Instant now;
  now.neighbours = two.data();
  now.num_neighbours = 1;
  const double one = always.force_z_N(now);
  ASSERT_NE(one, 0);
  now.num_neighbours = 2;
  const double weights[] = {1, 0.25};
  EXPECT_NEAR(force.force_z_N(now, weights), 0.75 * one, 1e-15) << "a quarter of what is silent is missing";
  const lipschitz::Box box{std::vector<double>(static_cast<std::size_t>(state_size(2)), -0.4),
                           std::vector<double>(static_cast<std::size_t>(state_size(2)), 0.4)};
  const LearnedForce::Forms forms = LearnedForce(network, "small", 2).over(box, nullptr);
  EXPECT_EQ(forms.upper_row.norm(), 0);
  EXPECT_EQ(forms.lower_row.norm(), 0);
  EXPECT_GE(forms.upper, 0);
  EXPECT_LT(forms.upper, 1e-12);
  EXPECT_LT(forms.lower, 1e-12);
  expect_enclosed(network, 3, 13);
}

}  // namespace
}  // namespace swarmcert::analysis

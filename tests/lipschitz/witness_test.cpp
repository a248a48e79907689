#include "lipschitz/checker/witness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace swarmcert::lipschitz {
namespace {

files::Layer layer(int outputs, int inputs, std::vector<double> weights, std::vector<double> biases) {
  return {"fc", outputs, inputs, std::move(weights), std::move(biases)};
}

files::Weights network(std::vector<files::Layer> layers) {
  files::Weights weights;
  weights.layers = std::move(layers);
  return weights;
}

SlopeFunction slope_function(const files::Weights& weights) { return {{&weights, nullptr}, {}, nullptr}; }

/// f(x) = (3 relu(x1 - x2) - relu(x2), relu(x2)) with x = (x1, x2).
files::Weights tiny() {
  return network({layer(2, 2, {1, -1, 0, 1}, {0, 0}), layer(2, 2, {3, -1, 0, 1}, {0, 0})});
}

/// Returns a 3-4-5-2 network whose weights have many binary digits.
files::Weights irregular() {
  std::vector<double> numbers;
  for (int i = 0; i < 60; ++i) numbers.push_back(static_cast<float>(((i * 37) % 23 - 11) / 7.0));
  const auto take = [&](int from, int count) {
    return std::vector<double>(numbers.begin() + from, numbers.begin() + from + count);
  };
  return network({layer(4, 3, take(0, 12), take(3, 4)), layer(5, 4, take(20, 20), take(40, 5)),
                  layer(2, 5, take(45, 10), take(7, 2))});
}

TEST(Witness, SlopeOfATinyNetworkIsTheHandComputedRational) {
  const files::Weights net = tiny();
  // f(2, 1) = (3 - 1, 1) = (2, 1); f(0, 4) = (-4, 4); |df|^2 = 36 + 9 = 45; |dx|^2 = 4 + 9 = 13.
  EXPECT_EQ(slope_squared(slope_function(net), {{2, 1}, {0, 4}, {}}), mpq_class(45, 13));
  const double lower = slope(slope_function(net), {{2, 1}, {0, 4}, {}}).value();
  EXPECT_LE(mpq_class(lower) * mpq_class(lower), mpq_class(45, 13));
  const double next = std::nextafter(lower, 9.0);
  EXPECT_GT(mpq_class(next) * mpq_class(next), mpq_class(45, 13)) << "not the largest such double";
}

TEST(Witness, NothingIsRoundedWhereDoublesWouldRound) {
  // relu(2^60 x + 1) - relu(2^60 x) + 2 relu(x): 7 at x = 3, where the first sum needs 62 bits, and 0 at x = -1.
  const double big = std::ldexp(1.0, 60);
  const files::Weights net = network({layer(3, 1, {big, big, 1}, {1, 0, 0}), layer(1, 3, {1, -1, 2}, {0})});
  EXPECT_EQ(slope_squared(slope_function(net), {{3}, {-1}, {}}), mpq_class(49, 16));
}

TEST(Witness, KinksAndSubnormalWeightsAreFine) {
  const double tiny_weight = std::numeric_limits<double>::denorm_min();
  const files::Weights net = network({layer(2, 1, {1, -1}, {0, 0}), layer(1, 2, {1, tiny_weight}, {0})});
  EXPECT_EQ(slope_squared(slope_function(net), {{0}, {1}, {}}), mpq_class(1));
  const mpq_class w(tiny_weight);
  EXPECT_EQ(slope_squared(slope_function(net), {{0}, {-1}, {}}), w * w);
  EXPECT_EQ(slope(slope_function(net), {{0}, {-1}, {}}).value(), tiny_weight);
}

TEST(Witness, ReversedItGivesTheSameSlope) {
  const files::Weights net = irregular();
  const std::vector<float> x = {0.3f, -1.7f, 2.9f};
  const std::vector<float> y = {-0.1f, 0.6f, 1.1f};
  EXPECT_GT(slope_squared(slope_function(net), {x, y, {}}), 0);
  EXPECT_EQ(slope_squared(slope_function(net), {x, y, {}}), slope_squared(slope_function(net), {y, x, {}}));
}

TEST(Witness, PermutedAndRescaledNeuronsLeaveItUnchanged) {
  const files::Weights net = irregular();
  files::Weights other = net;
  // Swaps neurons 0 and 2 of the first hidden layer and scales the new neuron 2 by 2^-3.
  for (int j = 0; j < 3; ++j) {
    std::swap(other.layers[0].weights[0 * 3 + j], other.layers[0].weights[2 * 3 + j]);
    other.layers[0].weights[2 * 3 + j] *= 0.125;
  }
  std::swap(other.layers[0].biases[0], other.layers[0].biases[2]);
  other.layers[0].biases[2] *= 0.125;
  for (int i = 0; i < 5; ++i) {
    std::swap(other.layers[1].weights[i * 4 + 0], other.layers[1].weights[i * 4 + 2]);
    other.layers[1].weights[i * 4 + 2] *= 8;
  }
  const SlopePoints points = {{0.3f, -1.7f, 2.9f}, {-0.1f, 0.6f, 1.1f}, {}};
  EXPECT_EQ(slope_squared(slope_function(net), points), slope_squared(slope_function(other), points));
}

TEST(Witness, DeepSetKeepsTheOthersFixed) {
  const files::Weights moved = network({layer(1, 2, {1, 1}, {0})});
  const files::Weights ground = network({layer(1, 1, {2}, {1})});
  const files::Weights rho = network({layer(1, 1, {1}, {-10}), layer(1, 1, {5}, {0})});
  const SlopeFunction f = {{&moved, nullptr}, {{&moved, nullptr}, {&ground, nullptr}}, &rho};
  // Sum before rho: x1 + x2 + (1 + 1) + (2 * 2 + 1) = x1 + x2 + 7, so the ReLU opens at x1 + x2 = 3.
  EXPECT_EQ(slope_squared(f, {{1, 0}, {3, 0}, {{1, 1}, {2}}}), mpq_class(0));
  EXPECT_EQ(slope_squared(f, {{3, 0}, {5, 0}, {{1, 1}, {2}}}), mpq_class(25));
  EXPECT_EQ(slope_squared(f, {{3, 0}, {4, 1}, {{1, 1}, {2}}}), mpq_class(50));
  EXPECT_EQ(slope_squared(f, {{2, 0}, {4, 0}, {{1, 1}, {2}}}), mpq_class(25, 4));
}

TEST(Witness, ClampIsPartOfTheFunction) {
  const files::Weights net = network({layer(1, 2, {2, 1}, {0})});
  const files::InputClamp clamp = {{-1, -1}, {1, 1}};
  const SlopeFunction f = {{&net, &clamp}, {}, nullptr};
  EXPECT_EQ(slope_squared(f, {{0, 5}, {1, 5}, {}}), mpq_class(4));
  EXPECT_EQ(slope_squared(f, {{0, 5}, {2, 5}, {}}), mpq_class(1));
  EXPECT_EQ(slope_squared(f, {{0, 5}, {0, 7}, {}}), mpq_class(0));
}

TEST(Witness, BlockRefusesOtherCoordinatesThatMove) {
  const files::Weights net = irregular();
  EXPECT_NO_THROW(slope_squared(slope_function(net), {{1, 2, 3}, {2, 2, 3}, {}}, {0}));
  EXPECT_THROW(slope_squared(slope_function(net), {{1, 2, 3}, {2, 2, 4}, {}}, {0}), std::invalid_argument);
  EXPECT_THROW(slope_squared(slope_function(net), {{1, 2, 3}, {2, 2, 3}, {}}, {3}), std::invalid_argument);
}

TEST(Witness, RefusesWhatIsNoWitness) {
  const files::Weights net = irregular();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(slope_squared(slope_function(net), {{1, 2, 3}, {1, 2, 3}, {}}), std::invalid_argument)
      << "x == y";
  EXPECT_THROW(slope_squared(slope_function(net), {{0, 2, 3}, {-0.0f, 2, 3}, {}}), std::invalid_argument)
      << "0 == -0";
  EXPECT_THROW(slope_squared(slope_function(net), {{1, 2}, {1, 2, 3}, {}}), std::invalid_argument);
  EXPECT_THROW(slope_squared(slope_function(net), {{1, 2, nan}, {1, 2, 3}, {}}), std::invalid_argument);
  EXPECT_THROW(slope_squared(slope_function(net), {{1, 2, 4}, {1, 2, 3}, {{1}}}), std::invalid_argument);
  const SlopeFunction sum_without_rho = {{&net, nullptr}, {{&net, nullptr}}, nullptr};
  EXPECT_THROW(slope_squared(sum_without_rho, {{1, 2, 4}, {1, 2, 3}, {{1, 2, 3}}}), std::invalid_argument);
}

TEST(SqrtDown, IsTheLargestDoubleBelowTheRoot) {
  const double largest = std::numeric_limits<double>::max();
  const double smallest = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(sqrt_down(0), 0);
  EXPECT_EQ(sqrt_down(mpq_class(9, 4)), 1.5);
  EXPECT_EQ(sqrt_down(mpq_class(largest) * mpq_class(largest) * 2), largest);
  EXPECT_EQ(sqrt_down(mpq_class(smallest) * mpq_class(smallest)), smallest);
  EXPECT_EQ(sqrt_down(mpq_class(smallest) * mpq_class(smallest) / 2), 0);
  EXPECT_EQ(sqrt_down(mpq_class(smallest) * mpq_class(smallest) * 35), 5 * smallest)
      << "must not round up to 6";
  for (int n = 2; n < 2000; n += 7) {
    const mpq_class square(n, 3 + n % 11);
    const double root = sqrt_down(square);
    const double next = std::nextafter(root, largest);
    EXPECT_LE(mpq_class(root) * mpq_class(root), square);
    EXPECT_GT(mpq_class(next) * mpq_class(next), square);
  }
  EXPECT_THROW(sqrt_down(-1), std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert::lipschitz

/// Slope maps: the upper bound of a cell is at least every slope in it, including that of its witness.
#include "lipschitz/slope_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lipschitz/boxes.h"
#include "lipschitz/lower/slope_estimate.h"
#include "lipschitz/networks.h"

namespace swarmcert::lipschitz {
namespace {

using tests::layer;
using tests::plain;
using tests::weights;

SlopeMapOptions map_of(const Box& box, std::array<int, 2> cells, const std::string& part = "network") {
  SlopeMapOptions options;
  options.coordinates = {0, 1};
  options.cells = cells;
  options.domain[part] = box;
  options.jobs = 1;
  return options;
}

std::vector<SlopeMap> maps_of(const files::Network& network, const SlopeMapOptions& options) {
  CertifyOptions certify_options;
  certify_options.lower.rounds = 0;
  certify_options.jobs = 1;
  return slope_maps(network, certify(network, certify_options), options);
}

TEST(SlopeMap, SeesWhereTheNetworkIsFlat) {
  // f(x, y) = 3 relu(x): slope 3 for x > 0, slope 0 for x < 0.
  const files::Network network = plain(weights({layer(1, 2, {3, 0}), layer(1, 1, {1})}));
  const std::vector<SlopeMap> maps = maps_of(network, map_of({{-1, -1}, {1, 1}}, {4, 2}));
  ASSERT_EQ(maps.size(), 1u);
  EXPECT_EQ(maps[0].function, "network");
  ASSERT_EQ(maps[0].cells.size(), 8u);
  for (const SlopeCell& cell : maps[0].cells) {
    if (cell.box.upper[0] <= -0.5) {
      EXPECT_TRUE(cell.is_local);
      EXPECT_LE(cell.upper.value(), 1e-6) << cell.box.lower[0];
    }
    if (cell.box.lower[0] < 0) continue;
    EXPECT_NEAR(cell.upper.value(), 3, 1e-3);
    ASSERT_TRUE(cell.lower.witness.has_value());
    EXPECT_NEAR(cell.lower.witness->slope.value(), 3, 1e-3);
  }
}

TEST(SlopeMap, CellsCoverTheBoxAndShareTheirEdges) {
  const files::Network network = plain(weights({layer(2, 3, {1, 0, 0, 0, 1, 1}), layer(1, 2, {1, -1})}));
  const Box box{{-0.3, 0.1, -5}, {0.4, 0.8, 5}};
  SlopeMapOptions options = map_of(box, {3, 7});
  options.rounds = 0;
  const std::vector<SlopeCell> cells = maps_of(network, options).at(0).cells;
  ASSERT_EQ(cells.size(), 21u);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t row = i / 7, column = i % 7;
    EXPECT_EQ(cells[i].box.lower[2], -5);
    EXPECT_EQ(cells[i].box.upper[2], 5);
    EXPECT_EQ(cells[i].box.lower[0], row == 0 ? box.lower[0] : cells[i - 7].box.upper[0]);
    EXPECT_EQ(cells[i].box.lower[1], column == 0 ? box.lower[1] : cells[i - 1].box.upper[1]);
    if (row == 2) {
      EXPECT_EQ(cells[i].box.upper[0], box.upper[0]);
    }
    if (column == 6) {
      EXPECT_EQ(cells[i].box.upper[1], box.upper[1]);
    }
  }
}

TEST(SlopeMap, NoSlopeInACellExceedsItsBoundAndWitnessesLieInside) {
  std::mt19937 generator(20);
  for (int n = 0; n < 3; ++n) {
    const files::Network network = plain(tests::random_network({3, 8, 8, 2}, generator));
    const Box box{{-1, -1, -0.2}, {1, 1, 0.3}};
    const files::Evaluator<double> f(*network.plain);
    int local = 0;
    const std::vector<SlopeMap> maps = maps_of(network, map_of(box, {3, 3}));
    ASSERT_EQ(maps.size(), 1u);
    for (const SlopeCell& cell : maps[0].cells) {
      local += cell.is_local ? 1 : 0;
      double steepest = 0;
      for (int i = 0; i < 400; ++i) {
        std::vector<double> x, y;
        for (std::size_t k = 0; k < 3; ++k) {
          std::uniform_real_distribution<double> coordinate(cell.box.lower[k], cell.box.upper[k]);
          x.push_back(coordinate(generator));
          y.push_back(i % 2 == 0 ? coordinate(generator) : x[k] + 1e-4 * (coordinate(generator) - x[k]));
        }
        const std::vector<double> fx = f(x), fy = f(y);
        const double rise = std::hypot(fx[0] - fy[0], fx[1] - fy[1]);
        steepest = std::max(steepest, rise / std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]));
      }
      EXPECT_LE(steepest, cell.upper.value() * (1 + 1e-9));
      ASSERT_TRUE(cell.lower.witness.has_value());
      EXPECT_LE(cell.lower.witness->slope.value(), cell.upper.value());
      EXPECT_GE(cell.lower.witness->slope.value(), 0.9 * steepest);
      for (const std::vector<float>* point : {&cell.lower.witness->x, &cell.lower.witness->y}) {
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_GE(static_cast<double>((*point)[k]), cell.box.lower[k]);
          EXPECT_LE(static_cast<double>((*point)[k]), cell.box.upper[k]);
        }
      }
    }
    EXPECT_GT(local, 0) << "no cell was proved by itself: the test shows nothing about local bounds";
  }
}

TEST(SlopeMap, IsTheSameForAnyNumberOfThreadsAndHasOneMapPerSetFunction) {
  std::mt19937 generator(711);
  const files::Weights phi = tests::random_network({6, 8, 6, 4}, generator);
  const files::Network network = tests::deep_set(phi, tests::random_network({4, 6, 6, 1}, generator));
  SlopeMapOptions options = map_of({{-1, -1, -1, -2, -2, -2}, {1, 1, 1, 2, 2, 2}}, {2, 2}, "phi:default");
  const std::vector<SlopeMap> one = maps_of(network, options);
  options.jobs = 3;
  const std::vector<SlopeMap> three = maps_of(network, options);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].function, "set:default:default");
  for (std::size_t i = 0; i < one[0].cells.size(); ++i) {
    EXPECT_EQ(one[0].cells[i].upper.value(), three[0].cells[i].upper.value());
    ASSERT_TRUE(one[0].cells[i].lower.witness && three[0].cells[i].lower.witness);
    EXPECT_EQ(one[0].cells[i].lower.witness->x, three[0].cells[i].lower.witness->x);
  }
}

TEST(SlopeMap, OtherNeighboursOfWitnessesAreAnywhereInTheirBox) {
  // f(x) = rho(x_0 + sum of the others), rho(s) = relu(s - 1.5): for x_0 <= 0, f is steep only because of the others.
  files::Weights rho = weights({layer(1, 1, {1}), layer(1, 1, {1})});
  rho.layers[0].biases[0] = -1.5;
  const files::Network network =
      tests::deep_set(weights({layer(2, 2, {1, 0, -1, 0}), layer(1, 2, {1, -1})}), rho);
  const std::vector<SlopeCell> cells =
      maps_of(network, map_of({{-1, -1}, {1, 1}}, {2, 2}, "phi:default")).at(0).cells;
  for (const SlopeCell& cell : cells) {
    ASSERT_TRUE(cell.lower.witness.has_value());
    EXPECT_NEAR(cell.lower.witness->slope.value(), 1, 1e-6);
    EXPECT_LE(cell.lower.witness->slope.value(), cell.upper.value());
    for (const std::vector<float>& other : cell.lower.witness->others) {
      EXPECT_GE(other[0], -1);
      EXPECT_LE(other[0], 1);
    }
  }
}

/// A map of a network with activations other than ReLU, and the bounds on the whole box.
struct SmoothMap {
  Certification found;
  SlopeMap map;  ///< the map of the last function that has one
};

SmoothMap smooth_map(const files::Network& network, const SlopeMapOptions& options) {
  CertifyOptions certify_options;
  certify_options.domain = options.domain;
  certify_options.lower.rounds = 0;
  certify_options.jobs = 1;
  SmoothMap result{certify(network, certify_options), {}};
  result.map = slope_maps(network, result.found, options).back();
  return result;
}

/// Expects that no cell exceeds the bound of the whole box, that some cell is at most `share` of it, and that each cell
/// is above the slopes found in it by the map and by a longer climb from other starts.
void expect_sound(const files::Network& network, const SlopeMapOptions& options, const std::string& name,
                  double share = 0.9) {
  SCOPED_TRACE(name);
  const SmoothMap smooth = smooth_map(network, options);
  const CertifiedBound* whole = nullptr;
  for (const CertifiedBound& bound : smooth.found.bounds)
    if (bound.function == smooth.map.function && bound.block == "all") whole = &bound;
  ASSERT_NE(whole, nullptr);
  double least = whole->upper.value();
  for (const SlopeCell& cell : smooth.map.cells) {
    least = std::min(least, cell.upper.value());
    EXPECT_LE(cell.upper.value(), whole->upper.value());
    EXPECT_EQ(cell.is_local, cell.upper.value() < whole->upper.value());
    if (cell.is_local) {
      EXPECT_TRUE(cell.method == UpperMethod::kLocalSdp || cell.method == UpperMethod::kLocalProduct);
    }
    ASSERT_TRUE(cell.lower.witness.has_value());
    EXPECT_GT(cell.lower.witness->slope.value(), 0);
    EXPECT_LE(cell.lower.witness->slope.value(), cell.upper.value());
    for (const std::vector<float>* point : {&cell.lower.witness->x, &cell.lower.witness->y}) {
      for (std::size_t k = 0; k < point->size(); ++k) {
        EXPECT_GE(static_cast<double>((*point)[k]), cell.box.lower[k]);
        EXPECT_LE(static_cast<double>((*point)[k]), cell.box.upper[k]);
      }
    }
    SlopeEstimateOptions climb;
    climb.seed = 77;
    climb.starts = 8;
    climb.domain = options.domain;
    climb.moved = cell.box;
    EXPECT_LE(slope_estimate(network, *whole, climb).value(), cell.upper.value() * (1 + 1e-9));
  }
  EXPECT_LT(least, share * whole->upper.value())
      << "the slopes in the cells change nothing: the map shows nothing";
}

TEST(SlopeMap, OfSmoothNetworksNoClimbedSlopeExceedsItsCell) {
  std::mt19937 generator(25);
  using A = files::Activation;
  const SlopeMapOptions options = map_of({{-2, -2, -0.1}, {2, 2, 0.1}}, {4, 3});
  for (const A activation : {A::kTanh, A::kSigmoid, A::kSoftplus, A::kElu, A::kSelu, A::kSilu, A::kGelu}) {
    files::Weights net = tests::random_network({3, 8, 8, 2}, generator);
    net.set_activations({activation, activation});
    expect_sound(plain(net), options, files::function_of(activation).op);
  }
  files::Weights mixed = tests::random_network({3, 8, 8, 2}, generator);
  mixed.set_activations({A::kRelu, A::kTanh});
  expect_sound(plain(mixed), options, "relu, tanh");
  files::Weights with_skip = tests::random_network({3, 8, 8, 2}, generator);
  with_skip.set_activations({A::kTanh, A::kSilu});
  with_skip.layers[0].kept = with_skip.layers[1].kept = 2;
  expect_sound(plain(with_skip), options, "tanh:6, silu:6");
  mixed.set_activations({A::kTanh, A::kMaxMinPairs});
  expect_sound(plain(mixed), options, "tanh, maxmin:pairs",
               0.95);  // the bound is the product with the steepest neuron of each layer
}

TEST(SlopeMap, OfSmoothSetFunctionsHoldsWhereverTheOthersAre) {
  std::mt19937 generator(26);
  using A = files::Activation;
  const std::pair<A, A> pairs[] = {{A::kTanh, A::kSilu}, {A::kRelu, A::kTanh}, {A::kGelu, A::kRelu}};
  for (const auto& [of_phi, of_rho] : pairs) {
    files::Weights phi = tests::random_network({3, 8, 4}, generator);
    files::Weights rho = tests::random_network({4, 6, 1}, generator);
    phi.set_activations({of_phi});
    rho.set_activations({of_rho});
    const files::Network network = tests::deep_set(phi, rho);
    expect_sound(network, map_of({{-2, -2, -0.1}, {2, 2, 0.1}}, {3, 3}, "phi:default"),
                 files::function_of(of_phi).op + " in front of " + files::function_of(of_rho).op);
  }
}

TEST(SlopeMap, SeesWhereTanhIsFlat) {
  // f(x, y) = tanh(3 x): the slope is 3 (1 - tanh(3 x)^2), largest at the point of a cell that is nearest to 0.
  const files::Network network =
      plain(tests::with(weights({layer(1, 2, {3, 0}), layer(1, 1, {1})}), files::Activation::kTanh));
  const SmoothMap smooth = smooth_map(network, map_of({{-2, -1}, {2, 1}}, {8, 2}));
  for (const SlopeCell& cell : smooth.map.cells) {
    const double nearest = cell.box.lower[0] >= 0 ? cell.box.lower[0] : -cell.box.upper[0];
    const double slope = 3 * (1 - std::pow(std::tanh(3 * nearest), 2));
    EXPECT_GE(cell.upper.value(), slope);
    EXPECT_LE(cell.upper.value(), slope * (1 + 1e-3) + 1e-6) << cell.box.lower[0];
    ASSERT_TRUE(cell.lower.witness.has_value());
    EXPECT_GE(cell.lower.witness->slope.value(), 0.9 * slope) << cell.box.lower[0];
  }
}

TEST(SlopeMap, NamesOfInputsAreUnderstoodAndOthersRefused) {
  files::Network network = plain(weights({layer(1, 2, {3, 0}), layer(1, 1, {1})}));
  EXPECT_EQ(map_coordinate(network, "x1"), 1);
  network.input_order = {"dp_x_m", "dp_z_m"};
  EXPECT_EQ(map_coordinate(network, "dp_z_m"), 1);
  EXPECT_THROW(map_coordinate(network, "x2"), std::invalid_argument);
  EXPECT_THROW(map_coordinate(network, "dp_y_m"), std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert::lipschitz

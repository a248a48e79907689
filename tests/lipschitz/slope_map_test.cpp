/// Slope maps: every cell's number is above each slope in it and at least the slope of its witness.
#include "lipschitz/slope_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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
  // f(x, y) = 3 relu(x): slope 3 for x > 0, none for x < 0.
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
  // f(x) = rho(x_0 + sum of the others), rho(s) = relu(s - 1.5): steep where x_0 <= 0 through others elsewhere alone.
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

#include "stability/sweep/grid.h"

#include <gtest/gtest.h>

#include <set>

#include "nn/base/random.h"

namespace swarmcert::stability {
namespace {

TEST(Grid, EachCellHasItsOwnValuesAndTheLastAxisMovesFastest) {
  Grid grid;
  grid.axes = {{"Kp", {1, 2}}, {"Kd", {3, 4, 5}}, {"Ki", {6, 7}}};
  ASSERT_EQ(grid.cells(), 12);
  EXPECT_EQ(grid.at(0), (std::vector<double>{1, 3, 6}));
  EXPECT_EQ(grid.at(1), (std::vector<double>{1, 3, 7}));
  EXPECT_EQ(grid.at(2), (std::vector<double>{1, 4, 6}));
  std::set<std::vector<double>> all;
  for (long k = 0; k < grid.cells(); ++k) all.insert(grid.at(k));
  EXPECT_EQ(all.size(), 12u);
}

TEST(Grid, TheFrontIsWhatNoFeasibleCellBeatsInEveryQuantity) {
  // One quantity for which less is better, and one for which more is better.
  std::string less, more;
  for (const Quantity& q : grid_quantities()) (q.better < 0 ? less : more) = q.name;
  ASSERT_FALSE(less.empty());
  ASSERT_FALSE(more.empty());
  Grid grid;
  grid.compute = grid.pareto = {less, more};
  files::Random random(8);
  std::vector<Cell> cells;
  for (long k = 0; k < 200; ++k) {
    cells.push_back({k, {random.uniform(), random.uniform()}, random.uniform() < 0.2 ? "too slow" : ""});
    if (random.uniform() < 0.05) cells.back().values[0] = NAN;
  }
  cells.push_back({200, {-1, 2}, "would beat all"});
  const std::vector<long> front = pareto_front(grid, cells);
  const auto beats = [](const Cell& a, const Cell& b) {
    return a.values[0] <= b.values[0] && a.values[1] >= b.values[1] &&
           (a.values[0] < b.values[0] || a.values[1] > b.values[1]);
  };
  ASSERT_GT(front.size(), 3u);
  const std::set<long> in_front(front.begin(), front.end());
  for (const Cell& cell : cells) {
    if (!cell.infeasible.empty() || std::isnan(cell.values[0])) {
      EXPECT_EQ(in_front.count(cell.index), 0u) << cell.index;
      continue;
    }
    bool is_beaten = false;
    for (const Cell& other : cells) is_beaten = is_beaten || (other.infeasible.empty() && beats(other, cell));
    EXPECT_EQ(in_front.count(cell.index), is_beaten ? 0u : 1u) << cell.index;
  }
}

}  // namespace
}  // namespace swarmcert::stability

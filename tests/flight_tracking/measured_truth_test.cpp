// A truth measured in flight: further flights stay within its ranges as often as stated, and its cells are those in
// which flights are judged.
#include "analysis/tracking/measured_truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "analysis/residuals/place_residual.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/base/random.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

constexpr int kLaterals = 4;

/// A separate force in each cell, a constant per flight, and noise per record.
Json residual_of_a_flight(files::Random& random, int records) {
  const double constant_N[3] = {0.002 * random.bell(), 0.002 * random.bell(), 0.004 * random.bell()};
  Json cells = Json::array();
  for (int lateral = 0; lateral < kLaterals; ++lateral) {
    std::array<double, 3> least{1, 1, 1}, largest{-1, -1, -1};
    for (int i = 0; i < records; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double wake_N = k == 2 ? -0.05 / (1 + lateral) : 0;
        const double x = wake_N + constant_N[k] + 0.001 * (1 + lateral) * random.bell();
        least[k] = std::min(least[k], x);
        largest[k] = std::max(largest[k], x);
      }
    }
    cells.push_back({{"cell", {0, lateral}}, {"records", records}, {"least", least}, {"largest", largest}});
  }
  return cells;
}

std::string written(const std::vector<Json>& flights) {
  Json document = {{"schema", "swarmcert/compare/1"},
                   {"unit", "N"},
                   {"place_grid",
                    {{"lowest_m", 0.2},
                     {"height_step_m", 0.1},
                     {"heights", 2},
                     {"lateral_step_m", 0.05},
                     {"laterals", kLaterals},
                     {"mean_s", 0.1}}},
                   {"flights", Json::array()}};
  for (std::size_t i = 0; i < flights.size(); ++i)
    document["flights"].push_back(
        {{"flight", "f" + std::to_string(100 + i)}, {"kind", "small"}, {"residual_by_place", flights[i]}});
  const std::string path = (std::filesystem::temp_directory_path() / "measured_truth_test.json").string();
  std::ofstream(path) << document.dump();
  return path;
}

bool keeps(const Json& flight, const ResidualEnvelope& envelope) {
  for (const Json& cell : flight) {
    const ResidualEnvelope::Cell& of = envelope.cells[envelope.at(cell["cell"][0], cell["cell"][1])];
    for (std::size_t k = 0; k < 3; ++k) {
      if (cell["least"][k].get<double>() < of.force_N[k].lower ||
          cell["largest"][k].get<double>() > of.force_N[k].upper)
        return false;
    }
  }
  return true;
}

TEST(MeasuredTruth, FurtherFlightsKeepAllItsRangesAsOftenAsItPromises) {
  files::Random random(11);
  const int campaigns = 120, further = 40;
  int kept = 0;
  double width_N = 0;
  for (int n = 0; n < campaigns; ++n) {
    std::vector<Json> flights;
    for (int i = 0; i < 30; ++i) flights.push_back(residual_of_a_flight(random, 20));
    const MeasuredTruth truth = read_measured_truth(written(flights), "small", 0.9);
    EXPECT_EQ(truth.shape_flights, 10);
    EXPECT_EQ(truth.promise.flights, 20);
    const Interval& far = truth.envelope.cells[truth.envelope.at(0, kLaterals - 1)].force_N[2];
    width_N += (far.upper - far.lower) / 2 / campaigns;
    for (int i = 0; i < further; ++i) kept += keeps(residual_of_a_flight(random, 20), truth.envelope) ? 1 : 0;
  }
  // The 19th of 20 flights: 19/21 = 0.905 on average; +-0.024 is three standard errors of 120 Beta(19, 2) draws plus
  // the contribution of 40 flights each.
  EXPECT_NEAR(kept / double(campaigns * further), 19.0 / 21, 0.024);
  // At most twice the range of nine in ten single flights for the worst axis: 1.64 constants and 2.6 noises.
  EXPECT_LT(width_N, 2 * (1.64 * 0.004 + 2.6 * 0.004));
}

TEST(MeasuredTruth, CellsWithoutAFlightTakeTheHullOfAllAndSaySo) {
  files::Random random(3);
  std::vector<Json> flights;
  for (int i = 0; i < 15; ++i) flights.push_back(residual_of_a_flight(random, 20));
  const ResidualEnvelope envelope = read_measured_truth(written(flights), "small", 0.9).envelope;
  for (const std::size_t empty : {envelope.at(1, 0), envelope.away()}) {
    EXPECT_EQ(envelope.cells[empty].flights, 0);
    for (int lateral = 0; lateral < kLaterals; ++lateral) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Interval inner = envelope.cells[envelope.at(0, lateral)].force_N[k],
                       outer = envelope.cells[empty].force_N[k];
        EXPECT_GE(outer.upper - outer.lower, 0.9 * (inner.upper - inner.lower));
      }
    }
  }
}

TEST(MeasuredTruth, TooFewFlightsAreRefusedWithTheNumberNeeded) {
  files::Random random(5);
  std::vector<Json> flights;
  const auto what = [&](const char* kind) {
    try {
      read_measured_truth(written(flights), kind, 0.9);
    } catch (const files::InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  for (int i = 0; i < 13; ++i) flights.push_back(residual_of_a_flight(random, 5));
  EXPECT_NE(what("small").find("at least 14"), std::string::npos) << what("small");
  flights.push_back(residual_of_a_flight(random, 5));
  EXPECT_EQ(what("small"), "");
  EXPECT_NE(what("large").find("at least 14"), std::string::npos) << "flights of another kind of vehicle";
}

/// Returns the cell of residuals::place_of() in the numbering of the envelope.
std::size_t cell_at(const ResidualEnvelope& envelope, const std::vector<Eigen::Vector3d>& places) {
  std::vector<stability::Neighbour> neighbours(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) neighbours[i].dp_W_m = places[i];
  stability::Instant now;
  now.neighbours = neighbours.data();
  now.num_neighbours = static_cast<int>(places.size());
  const auto [height, lateral] = residuals::place_of(now);
  return height < 0 ? envelope.away() : envelope.at(height, lateral);
}

TEST(ResidualEnvelope, ReachesEveryCellInWhichAFlightWithinTheOffsetsIsJudged) {
  using Grid = residuals::PlaceGrid;
  ResidualEnvelope envelope;
  envelope.lowest_m = Grid::kLowest_m;
  envelope.height_step_m = Grid::kHeightStep_m;
  envelope.lateral_step_m = Grid::kLateralStep_m;
  envelope.heights = Grid::kHeights;
  envelope.laterals = Grid::kLateral;
  envelope.cells.resize(envelope.at(envelope.heights, 0) + 1);
  files::Random random(8);
  int away = 0, near = 0;
  double most = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<Offset> offsets(static_cast<std::size_t>(1 + trial % 3));
    for (Offset& offset : offsets) {
      for (Interval& x : offset) {
        const double middle = 1.1 * random.symmetric(), half = 0.1 * std::abs(random.symmetric());
        x = {middle - half, middle + half};
      }
    }
    const std::vector<std::size_t> reached = envelope.reached(offsets);
    most = std::max(most, static_cast<double>(reached.size()));
    for (int i = 0; i < 50; ++i) {
      std::vector<Eigen::Vector3d> places;
      for (const Offset& offset : offsets) {
        Eigen::Vector3d& place = places.emplace_back();
        for (std::size_t k = 0; k < 3; ++k)
          place[static_cast<int>(k)] =
              offset[k].lower + (offset[k].upper - offset[k].lower) * (random.symmetric() + 1) / 2;
      }
      const std::size_t cell = cell_at(envelope, places);
      (cell == envelope.away() ? away : near) += 1;
      EXPECT_TRUE(std::binary_search(reached.begin(), reached.end(), cell)) << cell;
    }
  }
  EXPECT_GT(away, 1000);
  EXPECT_GT(near, 1000);
  EXPECT_LT(most, 0.5 * static_cast<double>(envelope.cells.size()));
}

}  // namespace
}  // namespace swarmcert::analysis

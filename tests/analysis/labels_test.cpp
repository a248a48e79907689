// Mislabelled logs: consistency of the streams of two vehicles, on recorded flights and on synthetic numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "analysis/identification/balance/mean_fit.h"
#include "analysis/identification/labels/exchanged_streams.h"
#include "analysis/identification/labels/mislabelled.h"
#include "analysis/residuals/inputs.h"
#include "data.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

/// Twelve blocks with the same misfit and a little scatter.
std::map<int, double> misfit_of(double square) {
  std::map<int, double> blocks;
  for (int b = 0; b < 12; ++b) blocks[b] = square * (1 + 0.1 * (b % 3));
  return blocks;
}

/// Three logs; all pairs fit badly except these.
Misfits three_logs(const std::vector<std::pair<int, int>>& good) {
  Misfits misfits;
  misfits.logs = 3;
  for (int own = 0; own < 3; ++own) {
    for (int other = 0; other < 3; ++other) {
      const bool fits = std::find(good.begin(), good.end(), std::pair(own, other)) != good.end();
      misfits.squares.push_back(misfit_of(fits ? 0.01 : 1));
    }
  }
  return misfits;
}

TEST(Labels, StreamsThatGoAroundACircleAreExchangedAndOthersAreNot) {
  EXPECT_EQ(belongs_to(three_logs({{0, 0}, {1, 1}, {2, 2}}), 6), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(belongs_to(three_logs({{0, 1}, {1, 0}, {2, 2}}), 6), (std::vector<int>{1, 0, 2}));
  EXPECT_EQ(belongs_to(three_logs({{0, 1}, {1, 2}, {2, 0}}), 6), (std::vector<int>{1, 2, 0}));
  // The first log fits the second log's data, which also fits its own: a vehicle that follows another one.
  EXPECT_EQ(belongs_to(three_logs({{0, 1}, {1, 1}, {2, 2}}), 6), (std::vector<int>{0, 1, 2}));
}

TEST(Labels, AnExchangeNeedsTwiceTheFitInManyBlocks) {
  Misfits misfits = three_logs({{0, 1}, {1, 0}, {2, 2}});
  misfits.squares[1] = misfit_of(0.3);  // the first log's misfit is hardly better than its own
  EXPECT_EQ(belongs_to(misfits, 6), (std::vector<int>{0, 1, 2}));
  misfits = three_logs({{0, 1}, {1, 0}, {2, 2}});
  for (auto& blocks : misfits.squares) blocks.erase(blocks.find(7), blocks.end());
  EXPECT_EQ(belongs_to(misfits, 6), (std::vector<int>{0, 1, 2}));
}

TEST(Labels, ATestOfManyPairsAsksForMore) {
  std::vector<double> differences;
  for (int b = 0; b < 40; ++b) differences.push_back(0.4 + (b % 2 == 0 ? 1 : -1));
  EXPECT_TRUE(surely_positive(differences, 1));
  EXPECT_FALSE(surely_positive(differences, 1'000'000'000));
  EXPECT_FALSE(surely_positive(std::vector<double>(40, -1), 1));
}

residuals::Inputs published(const std::string& flights) {
  residuals::InputArguments arguments;
  arguments.models = {tests::source_path("stability/models/crazyflie-small.toml"),
                      tests::source_path("stability/models/crazyflie-large.toml")};
  arguments.fleet = tests::source_path("analysis/flights/flights.toml");
  arguments.flights = {tests::data_path(flights)};
  arguments.rules.fits = true;
  return residuals::read_inputs(arguments);
}

TEST(Labels, NothingIsMislabelledInThePublishedFlights) {
  SWARMCERT_NEEDS_DATA();
  for (const std::string folder : {"flights/development", "flights/visible_test"}) {
    const std::vector<Mislabelled> found = mislabelled(published(folder), 2);
    for (const Mislabelled& label : found) ADD_FAILURE() << in_words(label);
  }
}

/// The record of `track` at a time, or the nearest one.
std::size_t record_at(const Track& track, double time_s) {
  const auto at =
      std::lower_bound(track.instants.begin(), track.instants.end(), time_s,
                       [](const stability::Instant& now, double then_s) { return now.time_s < then_s; });
  return std::min(static_cast<std::size_t>(at - track.instants.begin()), track.instants.size() - 1);
}

void take_set_points(const Track& from, Track& to) {
  for (std::size_t i = 0; i < to.targets.size(); ++i)
    to.targets[i] = from.targets[record_at(from, to.instants[i].time_s)];
}

void take_path(const Track& from, Track& to) {
  for (stability::Instant& now : to.instants) {
    const stability::Instant& then = from.instants[record_at(from, now.time_s)];
    now.p_W_m = then.p_W_m;
    now.v_W_m_s = then.v_W_m_s;
  }
}

/// Among the published flights of two vehicles that are judged: their number, and the number in which the exchange is
/// found.
template <typename Take, typename MisfitsOf>
std::pair<int, int> found_in_published_flights(const Take& take, const MisfitsOf& misfits_of) {
  const residuals::Inputs inputs = published("flights/development");
  int flights = 0, found = 0;
  for (std::size_t f = 0; f < inputs.found.flights.size(); ++f) {
    std::vector<std::string> problems;
    std::vector<Track> tracks = inputs.load(f, problems);
    if (tracks.size() != 2 || tracks[0].position_only || tracks[1].position_only) continue;
    const Track first = tracks[0];
    take(tracks[1], tracks[0]);
    take(first, tracks[1]);
    ++flights;
    found += belongs_to(misfits_of(tracks), 1000) == std::vector<int>{1, 0} ? 1 : 0;
  }
  return {flights, found};
}

TEST(Labels, ExchangedSetPointsOfPublishedFlightsAreFound) {
  SWARMCERT_NEEDS_DATA();
  const auto [flights, found] = found_in_published_flights(take_set_points, set_point_misfits);
  EXPECT_GE(flights, 20);
  EXPECT_EQ(found, flights);
}

TEST(Labels, ExchangedPathsOfPublishedFlightsAreFound) {
  SWARMCERT_NEEDS_DATA();
  const auto [flights, found] = found_in_published_flights(take_path, sensor_misfits);
  EXPECT_GE(flights, 20);
  EXPECT_EQ(found, flights);
}

}  // namespace
}  // namespace swarmcert::identification

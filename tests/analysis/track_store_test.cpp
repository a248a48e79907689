/// Excerpts of flights, the store of tracks, and a diagnosis that searches an excerpt.
#include "analysis/residuals/track_store.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>

#include "analysis/identification/diagnose.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"

namespace swarmcert::tests {
namespace {

using residuals::Cut;
using residuals::excerpt_of;
using residuals::Track;

/// A track at 100 Hz with one neighbour; the first 5 s on the ground. The fields of a record encode its time.
Track straight_track(int seconds) {
  Track track;
  track.flight = "a/00";
  track.vehicle = "cf1";
  const auto n = static_cast<std::size_t>(100 * seconds);
  track.instants.resize(n);
  track.neighbours.resize(n);
  track.duty.resize(n);
  track.specific_force_m_s2.resize(n, Eigen::Vector3d::Zero());
  track.restarts.assign(n, 0);
  track.restarts[0] = 1;
  track.cut.assign(n, Cut::kNone);
  for (std::size_t i = 0; i < n; ++i) {
    track.instants[i].time_s = 0.01 * static_cast<double>(i);
    track.instants[i].neighbours = &track.neighbours[i];
    track.instants[i].num_neighbours = 1;
    track.neighbours[i].dp_W_m.x() = track.instants[i].time_s;
    track.specific_force_m_s2[i].x() = track.instants[i].time_s;
    if (i < 500) track.cut[i] = Cut::kContact;
  }
  return track;
}

TEST(Excerpt, TakesTheShareOfTheUsedRecordsInStretchesOverTheWholeFlight) {
  const Track part = excerpt_of(straight_track(1005), 0.2);
  EXPECT_NEAR(static_cast<double>(part.used), 0.2 * 100'000, 50);
  EXPECT_EQ(std::count(part.restarts.begin(), part.restarts.end(), 1), 10) << "200 s in stretches of 20 s";
  double longest_s = 0;
  for (std::size_t i = 1; i < part.instants.size(); ++i)
    longest_s = std::max(longest_s, part.instants[i].time_s - part.instants[i - 1].time_s);
  EXPECT_LT(longest_s, 160) << "one stretch in each 100 s";
}

TEST(Excerpt, KeepsWhatBelongsToARecordTogetherAndCutsWhatFiltersRemember) {
  const Track part = excerpt_of(straight_track(305), 0.1);
  ASSERT_EQ(part.neighbours.size(), part.instants.size());
  double restart_s = -1;
  for (std::size_t i = 0; i < part.instants.size(); ++i) {
    const double time_s = part.instants[i].time_s;
    EXPECT_EQ(part.instants[i].neighbours, &part.neighbours[i]);
    EXPECT_EQ(part.instants[i].neighbours->dp_W_m.x(), time_s);
    EXPECT_EQ(part.specific_force_m_s2[i].x(), time_s);
    if (part.restarts[i] != 0) restart_s = time_s;
    if (time_s - restart_s < 0.98) {
      EXPECT_NE(part.cut[i], Cut::kNone) << time_s;
    }
  }
  EXPECT_GE(part.used, 2980u);
}

TEST(Excerpt, OfAShortFlightIsNotShorterThanFourSeconds) {
  EXPECT_NEAR(static_cast<double>(excerpt_of(straight_track(45), 0.01).used), 400, 2);
  EXPECT_EQ(excerpt_of(straight_track(8), 0.01).used, 300u) << "all that is used";
}

TEST(TrackStore, OfManyShortTracksTakesAboutTheShare) {
  constexpr int kTracks = 300;
  constexpr double kShare = 0.05;  // 1.5 s of each
  residuals::TrackStore store(kShare);
  std::size_t used = 0;
  int taken = 0;
  for (int k = 0; k < kTracks; ++k) {
    residuals::FlightFiles flight;
    flight.logs = {{"cf1", "cf1_" + std::to_string(k)}};
    const auto load = [&](std::vector<std::string>&) {
      std::vector<Track> tracks;
      tracks.push_back(straight_track(35));
      tracks[0].flight = "a/" + std::to_string(k);
      return tracks;
    };
    std::vector<std::string> problems;
    for (const Track& track : store.tracks(flight, load, problems)) {
      EXPECT_NEAR(static_cast<double>(track.used), 400, 2);
      used += track.used;
      ++taken;
    }
  }
  // 112 tracks are expected. Names determine the selection, so the number has a standard deviation of 8.
  constexpr double kExpected = kShare * kTracks * 3000, kFourDeviations = 0.3;
  EXPECT_NEAR(static_cast<double>(used), kExpected, kFourDeviations * kExpected);
  EXPECT_NEAR(taken, kTracks * 1.5 / 4, kFourDeviations * kTracks * 1.5 / 4);
}

TEST(TrackStore, GivesEachTimeWhatTheFirstLoadGaveAndStaysBelowItsLimit) {
  int loads = 0;
  const auto load = [&](std::vector<std::string>& problems) {
    ++loads;
    problems.emplace_back("told");
    std::vector<Track> tracks;
    tracks.push_back(straight_track(20));
    return tracks;
  };
  residuals::FlightFiles flight;
  flight.logs = {{"cf1", "cf1_00"}};
  for (const bool fits : {true, false}) {
    loads = 0;
    residuals::TrackStore store(1, fits ? residuals::TrackStore::kMost_bytes : 1000);
    for (int pass = 0; pass < 3; ++pass) {
      std::vector<std::string> problems;
      const std::vector<Track> tracks = store.tracks(flight, load, problems);
      EXPECT_EQ(problems, std::vector<std::string>{"told"});
      ASSERT_EQ(tracks.size(), 1u);
      EXPECT_EQ(tracks[0].instants[7].neighbours, &tracks[0].neighbours[7]);
    }
    EXPECT_EQ(loads, fits ? 1 : 3);
  }
}

TEST(Diagnose, OfAnExcerptFitsWhatItNamesToAllFlightsOnAnyNumberOfThreads) {
  constexpr double kDrag_N_s_m = 0.02;
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("excerpt-" + std::to_string(getpid()));
  Truth truth;
  truth.force_N = [](const Moment& now) { return Eigen::Vector3d(-kDrag_N_s_m * now.v_m_s); };
  for (int run = 0; run < 6; ++run)
    fly(truth, {Program::kRich, 1, 40, static_cast<std::uint64_t>(run)}, folder.string(), run);
  residuals::InputArguments arguments;
  arguments.models = {source_path("stability/models/crazyflie-small.toml")};
  arguments.flights = {folder.string()};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  const auto diagnosed = [&](int jobs, std::size_t most) {
    return identification::diagnose(
        inputs, "small", identification::every_flight(inputs), jobs, [](int, int) {}, most);
  };
  const auto whole = diagnosed(2, 1000), excerpt = diagnosed(2, 40), alone = diagnosed(1, 40);
  EXPECT_EQ(whole.searched_blocks, whole.blocks);
  EXPECT_LT(excerpt.searched_blocks, 60u);
  EXPECT_EQ(excerpt.blocks, whole.blocks);
  ASSERT_EQ(excerpt.ranking.size(), 1u);
  ASSERT_EQ(whole.ranking.size(), 1u);
  const auto& few = excerpt.ranking[0];
  const auto& all = whole.ranking[0];
  EXPECT_EQ(few.effect, "drag_linear");
  EXPECT_NEAR(few.parameters.at("drag_N_s_m"), all.parameters.at("drag_N_s_m"), 1e-9)
      << "fitted to the same records";
  EXPECT_NEAR(excerpt.rmse_after_N, whole.rmse_after_N, 1e-9);
  EXPECT_EQ(few.parameters, alone.ranking.at(0).parameters);
  EXPECT_EQ(few.intervals, alone.ranking.at(0).intervals);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace swarmcert::tests

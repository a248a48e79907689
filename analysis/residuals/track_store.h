/// @file Tracks that are kept between passes over the flights, complete or as excerpts.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Returns an excerpt with about the fraction `share` of the used records of `track`, in stretches of 4 to 20 s spread
/// over the flight; a track too short for that is kept whole. The position of each stretch within its part of the
/// flight is derived from the names of flight and vehicle. Because filters and memories restart before a stretch, up to
/// 1 s ahead of it is kept as well, cut as Cut::kSettling.
Track excerpt_of(const Track& track, double share);

/// Returns the records of `track` within `part_s` on the flight's clock, and up to 1 s ahead of them, as excerpt_of().
Track part_of(const Track& track, Interval part_s);

/// Tracks as loaded by load_flight(), independent of the model, so that passes with other models can reuse them.
/// Thread-safe. Tracks that do not fit into memory are loaded again each time.
class TrackStore {
 public:
  static constexpr std::size_t kMost_bytes = std::size_t{256} << 20;
  using Load = std::function<std::vector<Track>(std::vector<std::string>& problems)>;

  /// @param share of the records, see excerpt_of(); 1: all. Of tracks too short to be split, only some contribute a
  ///   stretch.
  explicit TrackStore(double share, std::size_t most_bytes = kMost_bytes)
      : share_(share), most_bytes_(most_bytes) {}

  /// Returns the tracks of `flight` from memory or from `load`, which must give the same result for the same flight.
  /// `problems` receives the messages of `load`.
  std::vector<Track> tracks(const FlightFiles& flight, const Load& load, std::vector<std::string>& problems);

 private:
  struct Kept {
    std::vector<Track> tracks;
    std::vector<std::string> problems;
  };
  Kept loaded(const Load& load) const;

  const double share_;
  const std::size_t most_bytes_;
  std::mutex mutex_;
  std::map<std::string, Kept> kept_;  ///< by the name of the flight and the path of its first log
  std::size_t held_bytes_ = 0;
};

}  // namespace swarmcert::residuals

/// @file Tracks that are kept between passes over the flights, whole or in excerpts.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Of the records of `track` that are used about the share `share`, in stretches of at most 20 s and at least 4 s that
/// are spread over the flight; a track of less than that is whole. Where a stretch lies within its part of the flight
/// follows from the names of flight and vehicle. Filters and memories restart before it: up to 1 s ahead of each
/// stretch is kept as well, cut as Cut::kSettling.
Track excerpt_of(const Track& track, double share);

/// Tracks as load_flight() gives them, without any model, so that passes with other models need not make them anew.
/// Safe to use from several threads. What does not fit into the memory is made anew each time.
class TrackStore {
 public:
  static constexpr std::size_t kMost_bytes = std::size_t{256} << 20;
  using Load = std::function<std::vector<Track>(std::vector<std::string>& problems)>;

  /// @param share of the records, see excerpt_of(); 1: all. Of tracks too short to share, only some have a stretch.
  explicit TrackStore(double share, std::size_t most_bytes = kMost_bytes)
      : share_(share), most_bytes_(most_bytes) {}

  /// The tracks of `flight`, from memory or from `load`, which must be the same for the same flight. `problems` gets
  /// what `load` had to say.
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
  std::map<std::string, Kept> kept_;  ///< by the path of the flight's first log
  std::size_t held_bytes_ = 0;
};

}  // namespace swarmcert::residuals

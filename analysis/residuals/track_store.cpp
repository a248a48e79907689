#include "analysis/residuals/track_store.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace swarmcert::residuals {
namespace {

constexpr double kStretch_s = 20, kShortest_s = 4, kLead_s = 1;

/// Keeps the elements `kept`, each of which stands for `width` consecutive values. Does nothing if `values` is empty.
template <typename T>
void keep(std::vector<T>& values, const std::vector<std::size_t>& kept, std::size_t width = 1) {
  if (values.empty()) return;
  std::vector<T> few;
  few.reserve(kept.size() * width);
  for (const std::size_t i : kept) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(i * width);
    few.insert(few.end(), first, first + static_cast<std::ptrdiff_t>(width));
  }
  values = std::move(few);
}

/// Makes the records of `track` point to its own neighbours, which is necessary after a copy.
void own_neighbours(Track& track) {
  if (track.instants.empty()) return;
  const std::size_t width = track.neighbours.size() / track.instants.size();
  for (std::size_t i = 0; i < track.instants.size(); ++i)
    track.instants[i].neighbours = track.neighbours.data() + i * width;
}

std::vector<Track> copies(const std::vector<Track>& tracks) {
  std::vector<Track> all = tracks;
  for (Track& track : all) own_neighbours(track);
  return all;
}

/// Returns an FNV-1a hash as a number from 0 to 1, the same on every machine.
double number_of(const std::string& text) {
  std::uint32_t hash = 2166136261U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  return hash / 4294967296.0;
}

std::size_t bytes_of(const Track& track) {
  return track.instants.size() *
             (sizeof(stability::Instant) + sizeof(track.duty[0]) + sizeof(Eigen::Vector3d) + 2) +
         track.neighbours.size() * sizeof(stability::Neighbour) +
         track.targets.size() * sizeof(stability::Setpoint) +
         track.motor_command.size() * sizeof(track.motor_command[0]) +
         track.given_thrust.size() * sizeof(double);
}

/// Returns the duration of the records without a cut.
double used_s(const Track& track) {
  const auto used = static_cast<double>(std::count(track.cut.begin(), track.cut.end(), Cut::kNone));
  return used * track.duration_s() / std::max(static_cast<double>(track.instants.size()) - 1, 1.0);
}

/// Returns whether an excerpt takes a stretch of this track. If the share of a track is shorter than the shortest
/// stretch, only some of the tracks contribute one, so that the expected total is the share. A hash of the names of
/// flight and vehicle decides; the suffix is hashed last, because FNV-1a mixes the last characters poorly.
bool takes_part(const Track& track, double share) {
  const double all_s = used_s(track), stretch_s = std::min(kShortest_s, all_s);
  return share * all_s >= stretch_s ||
         number_of(track.flight + "/" + track.vehicle + " takes part") * stretch_s < share * all_s;
}

/// Returns the stretches of an excerpt as ranges of positions in `used`, the records without a cut.
std::vector<std::pair<std::size_t, std::size_t>> stretches(const Track& track,
                                                           const std::vector<std::size_t>& used,
                                                           double share) {
  const double records_per_s = static_cast<double>(track.instants.size() - 1) / track.duration_s();
  const double used_s = static_cast<double>(used.size()) / records_per_s;
  const double parts = std::max(1.0, std::round(used_s * share / kStretch_s));
  const double length_s = std::max(used_s * share / parts, kShortest_s);
  const auto length = static_cast<std::size_t>(length_s * records_per_s);
  const double golden = 0.6180339887498949;
  double at = number_of(track.flight + "/" + track.vehicle);
  std::vector<std::pair<std::size_t, std::size_t>> result;
  for (double part = 0; part < parts; ++part) {
    const auto begin = static_cast<std::size_t>(part / parts * static_cast<double>(used.size()));
    const auto end = static_cast<std::size_t>((part + 1) / parts * static_cast<double>(used.size()));
    const std::size_t spare = end - begin > length ? end - begin - length : 0;
    const std::size_t first = begin + static_cast<std::size_t>(at * static_cast<double>(spare));
    result.emplace_back(first, std::min(first + length, end));
    at = std::fmod(at + golden, 1.0);
  }
  return result;
}

/// A range [first, second) of records.
using Range = std::pair<std::size_t, std::size_t>;

/// Keeps the records of `ranges`, which are in order, and ahead of each what filters need to settle.
Track with_ranges(const Track& track, const std::vector<Range>& ranges) {
  Track result = track;
  std::vector<std::size_t> kept;
  for (const auto& [from, to] : ranges) {
    const std::size_t before = kept.empty() ? 0 : kept.back() + 1;
    std::size_t lead = from;
    while (lead > before && track.instants[from].time_s - track.instants[lead - 1].time_s <= kLead_s) --lead;
    if (lead > before || (kept.empty() && lead > 0)) {
      result.restarts[lead] = 1;
      for (std::size_t i = lead; i < from; ++i) {
        if (result.cut[i] == Cut::kNone) result.cut[i] = Cut::kSettling;
      }
    }
    for (std::size_t i = lead; i < to; ++i) kept.push_back(i);
  }
  const std::size_t width = track.neighbours.size() / track.instants.size();
  keep(result.instants, kept);
  keep(result.neighbours, kept, width);
  keep(result.duty, kept);
  keep(result.motor_command, kept);
  keep(result.given_thrust, kept);
  keep(result.specific_force_m_s2, kept);
  keep(result.targets, kept);
  keep(result.restarts, kept);
  keep(result.cut, kept);
  result.used = static_cast<std::size_t>(std::count(result.cut.begin(), result.cut.end(), Cut::kNone));
  own_neighbours(result);
  return result;
}

}  // namespace

Track excerpt_of(const Track& track, double share) {
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < track.cut.size(); ++i) {
    if (track.cut[i] == Cut::kNone) used.push_back(i);
  }
  if (used.empty() || share >= 1 || !(track.duration_s() > 0)) {
    Track whole = track;
    own_neighbours(whole);
    return whole;
  }
  std::vector<Range> ranges;
  for (const auto& [first, last] : stretches(track, used, share))
    if (first < last) ranges.emplace_back(used[first], used[last - 1] + 1);
  return with_ranges(track, ranges);
}

Track part_of(const Track& track, Interval part_s) {
  const auto before = [](const stability::Instant& instant, double time_s) {
    return instant.time_s < time_s;
  };
  const auto place_of = [&](double time_s) {
    const auto at = std::lower_bound(track.instants.begin(), track.instants.end(), time_s, before);
    return static_cast<std::size_t>(at - track.instants.begin());
  };
  if (track.instants.empty()) return track;
  return with_ranges(track, {{place_of(part_s.lower), place_of(part_s.upper)}});
}

TrackStore::Kept TrackStore::loaded(const Load& load) const {
  Kept all;
  all.tracks = load(all.problems);
  if (share_ >= 1) return all;
  const auto is_left_out = [&](const Track& track) {
    return !track.position_only && !takes_part(track, share_);
  };
  all.tracks.erase(std::remove_if(all.tracks.begin(), all.tracks.end(), is_left_out), all.tracks.end());
  for (Track& track : all.tracks) {
    own_neighbours(track);  // erasing has moved the track
    if (!track.position_only) track = excerpt_of(track, share_);
  }
  return all;
}

std::vector<Track> TrackStore::tracks(const FlightFiles& flight, const Load& load,
                                      std::vector<std::string>& problems) {
  const std::string key = flight.name + '\n' + flight.logs.at(0).second;
  const auto tell = [&](const Kept& known) {
    problems.insert(problems.end(), known.problems.begin(), known.problems.end());
  };
  const Kept* known = nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = kept_.find(key);
    if (found != kept_.end()) known = &found->second;
  }
  if (known != nullptr) {  // never erased or changed
    tell(*known);
    return copies(known->tracks);
  }
  Kept made = loaded(load);
  tell(made);
  std::size_t bytes = 0;
  for (const Track& track : made.tracks) bytes += bytes_of(track);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (held_bytes_ + bytes > most_bytes_ || kept_.count(key) != 0) return std::move(made.tracks);
  held_bytes_ += bytes;
  const Kept& kept = kept_.emplace(key, std::move(made)).first->second;
  return copies(kept.tracks);
}

}  // namespace swarmcert::residuals

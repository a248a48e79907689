#include "analysis/identification/labels/exchanged_streams.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/identification/balance/force_means.h"
#include "analysis/identification/balance/mean_fit.h"

namespace swarmcert::identification {
namespace {

using Eigen::Vector3d;
using residuals::Track;

constexpr double kStreamBlock_s = 1, kPathSample_s = 0.1, kGain_s = 0.5, kLongestStep_s = 0.1;
constexpr double kTimesBetter = 2;

int block_at(double time_s) { return static_cast<int>(std::floor(time_s / kStreamBlock_s)); }

/// Interpolates a quantity of a track between its records; calls must be in order of time.
class StreamReader {
 public:
  explicit StreamReader(const Track& track) : track_(track) {}

  /// Returns nothing outside the track and in its gaps.
  template <typename Value>
  std::optional<Vector3d> at(double time_s, const Value& value) {
    const auto& instants = track_.instants;
    while (next_ < instants.size() && instants[next_].time_s < time_s) ++next_;
    if (next_ == 0 || next_ == instants.size()) return std::nullopt;
    const double from_s = instants[next_ - 1].time_s, step_s = instants[next_].time_s - from_s;
    if (!(step_s < kLongestStep_s) || track_.restarts[next_] != 0) return std::nullopt;
    const double share = (time_s - from_s) / step_s;
    return Vector3d((1 - share) * value(next_ - 1) + share * value(next_));
  }

 private:
  const Track& track_;
  std::size_t next_ = 0;
};

/// Means of squares by block.
class BlockMeans {
 public:
  void add(double time_s, double square) {
    auto& [sum, count] = sums_[block_at(time_s)];
    sum += square;
    ++count;
  }
  std::map<int, double> means() const {
    std::map<int, double> result;
    for (const auto& [block, sum] : sums_) result[block] = sum.first / sum.second;
    return result;
  }

 private:
  std::map<int, std::pair<double, int>> sums_;
};

bool has_set_points(const Track& track) { return track.targets.size() == track.instants.size(); }

std::map<int, double> set_point_misfit(const Track& own, const Track& other) {
  if (own.instants.empty() || !has_set_points(own) || !has_set_points(other)) return {};
  StreamReader reader(other);
  BlockMeans blocks;
  double next_s = own.instants[0].time_s;
  for (std::size_t i = 0; i < own.instants.size(); ++i) {
    const stability::Instant& now = own.instants[i];
    if (own.cut[i] != residuals::Cut::kNone || now.time_s < next_s) continue;
    next_s = now.time_s + kPathSample_s;
    const std::optional<Vector3d> target_m =
        reader.at(now.time_s, [&](std::size_t k) { return other.targets[k].p_W_m; });
    if (target_m) blocks.add(now.time_s, (now.p_W_m - *target_m).squaredNorm());
  }
  return blocks.means();
}

/// Mean specific force over a stretch without cuts.
struct Felt {
  double from_s = 0, to_s = 0;
  Vector3d mean_m_s2;
};

std::vector<Felt> felt_by(const Track& track) {
  std::vector<Felt> all;
  if (track.position_only || track.force_source != logs::ForceSource::kAccelerometer) return all;
  for (const ForceMean& one : specific_force_means(track, kGain_s))
    all.push_back({track.instants[one.first].time_s, track.instants[one.last].time_s, one.mean_m_s2});
  return all;
}

std::map<int, double> sensor_misfit(const std::vector<Felt>& felt, const Track& path) {
  StreamReader from(path), to(path);
  const auto velocity = [&](std::size_t k) { return path.instants[k].v_W_m_s; };
  std::vector<std::pair<double, Vector3d>> misfits;
  Vector3d mean = Vector3d::Zero();
  for (const Felt& one : felt) {
    const std::optional<Vector3d> before = from.at(one.from_s, velocity), after = to.at(one.to_s, velocity);
    if (!before || !after) continue;
    misfits.emplace_back(one.from_s, (*after - *before) / (one.to_s - one.from_s) - one.mean_m_s2);
    mean += misfits.back().second;
  }
  mean /= static_cast<double>(std::max<std::size_t>(misfits.size(), 1));
  BlockMeans blocks;
  for (const auto& [time_s, misfit] : misfits) blocks.add(time_s, (misfit - mean).squaredNorm());
  return blocks.means();
}

struct Comparison {
  double own = 0, other = 0;  ///< mean squares
  std::vector<double> gains;  ///< decrease of the logarithm of the square
};

Comparison comparison(const Misfits& misfits, int own, int other) {
  Comparison result;
  const std::map<int, double>& of_own = misfits.of(own, own);
  for (const auto& [block, square] : misfits.of(own, other)) {
    const auto same = of_own.find(block);
    if (same == of_own.end()) continue;
    result.own += same->second;
    result.other += square;
    // A few manoeuvres dominate the sum, so all blocks are weighted equally. Misfits are clamped to a micrometre.
    constexpr double kFloor = 1e-12;
    result.gains.push_back(std::log((same->second + kFloor) / (square + kFloor)));
  }
  const auto count = static_cast<double>(std::max<std::size_t>(result.gains.size(), 1));
  result.own /= count;
  result.other /= count;
  return result;
}

}  // namespace

Misfits set_point_misfits(const std::vector<Track>& tracks) {
  Misfits misfits;
  misfits.logs = static_cast<int>(tracks.size());
  for (const Track& own : tracks) {
    for (const Track& other : tracks) misfits.squares.push_back(set_point_misfit(own, other));
  }
  return misfits;
}

Misfits sensor_misfits(const std::vector<Track>& tracks) {
  Misfits misfits;
  misfits.logs = static_cast<int>(tracks.size());
  for (const Track& own : tracks) {
    const std::vector<Felt> felt = felt_by(own);
    for (const Track& other : tracks) misfits.squares.push_back(sensor_misfit(felt, other));
  }
  return misfits;
}

std::vector<int> belongs_to(const Misfits& misfits, int tried) {
  std::vector<int> to;
  for (int own = 0; own < misfits.logs; ++own) {
    int best = own;
    double least = 0;
    for (int other = 0; other < misfits.logs; ++other) {
      const Comparison compared = comparison(misfits, own, other);
      if (other == own || compared.own < kTimesBetter * kTimesBetter * compared.other) continue;
      if (!surely_positive(compared.gains, tried) || (best != own && compared.other >= least)) continue;
      best = other;
      least = compared.other;
    }
    to.push_back(best);
  }
  std::vector<int> closed = to;
  for (int own = 0; own < misfits.logs; ++own) {
    int at = to[static_cast<std::size_t>(own)];
    for (int step = 0; step < misfits.logs && at != own; ++step) at = to[static_cast<std::size_t>(at)];
    if (at != own) closed[static_cast<std::size_t>(own)] = own;
  }
  return closed;
}

double root_mean_square(const Misfits& misfits, int own, int other) {
  return std::sqrt(comparison(misfits, own, other).other);
}

}  // namespace swarmcert::identification

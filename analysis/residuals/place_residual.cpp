#include "analysis/residuals/place_residual.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace swarmcert::residuals {

std::array<int, 2> place_of(const stability::Instant& now) {
  std::array<int, 2> place{-1, -1};
  double nearest_m = INFINITY;
  for (int j = 0; j < now.num_neighbours; ++j) {
    const Eigen::Vector3d& dp = now.neighbours[j].dp_W_m;
    const double lateral_m = dp.head<2>().norm();
    const double height = std::floor((dp.z() - PlaceGrid::kLowest_m) / PlaceGrid::kHeightStep_m);
    if (!(lateral_m < nearest_m) || !(height >= 0) || height >= PlaceGrid::kHeights) continue;
    nearest_m = lateral_m;
    place = {static_cast<int>(height),
             static_cast<int>(std::min(lateral_m / PlaceGrid::kLateralStep_m, 1e6))};
  }
  if (place[1] >= PlaceGrid::kLateral) return {-1, -1};
  return place;
}

namespace {

/// Adds the records first .. end, which are consecutive and without gaps.
void add_run(const Track& track, const std::vector<Eigen::Vector3d>& r, std::size_t first, std::size_t end,
             std::map<std::array<int, 2>, PlaceResidual>& cells) {
  const auto time_s = [&track](std::size_t i) { return track.instants[i].time_s; };
  constexpr double kHalf_s = kPlaceMean_s / 2;
  std::size_t from = first, to = first;  // range of the mean
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = first; i < end; ++i) {
    while (to < end && time_s(to) <= time_s(i) + kHalf_s) sum += r[to++];
    while (time_s(from) < time_s(i) - kHalf_s) sum -= r[from++];
    if (time_s(i) - kHalf_s < time_s(first) || time_s(i) + kHalf_s > time_s(end - 1)) continue;
    const Eigen::Vector3d mean = sum / static_cast<double>(to - from);
    const std::array<int, 2> cell = place_of(track.instants[i]);
    const auto [found, is_new] = cells.insert({cell, {cell, 0, mean, mean}});
    PlaceResidual& place = found->second;
    ++place.records;
    place.least_N = place.least_N.cwiseMin(mean);
    place.largest_N = place.largest_N.cwiseMax(mean);
  }
}

}  // namespace

std::vector<PlaceResidual> place_residuals(const Track& track, const std::vector<Eigen::Vector3d>& r) {
  std::map<std::array<int, 2>, PlaceResidual> cells;
  std::size_t first = 0;
  for (std::size_t i = 0; i <= r.size(); ++i) {
    const bool is_cut = i == r.size() || track.cut[i] != Cut::kNone;
    if (!is_cut && track.restarts[i] == 0) continue;
    if (i > first) add_run(track, r, first, i, cells);
    first = is_cut ? i + 1 : i;
  }
  std::vector<PlaceResidual> result;
  for (const auto& [cell, place] : cells) result.push_back(place);
  return result;
}

}  // namespace swarmcert::residuals

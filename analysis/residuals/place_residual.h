/// @file The range of the force residual by where the neighbour is, flight by flight: from it `bound --tube --from`
/// makes the truth that a tube is proved for.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Cells of the place of a neighbour, seen from the vehicle; which one counts: see place_of().
struct PlaceGrid {
  static constexpr int kLateral = 12, kHeights = 20;
  static constexpr double kLateralStep_m = 0.05, kHeightStep_m = 0.1, kLowest_m = -1;
};

/// [height of the neighbour above the vehicle, from kLowest_m up; lateral distance, from 0] of the neighbour that is
/// laterally nearest among those within the grid's heights; -1, -1 where none is, or that one is too far away.
std::array<int, 2> place_of(const stability::Instant& now);

/// What a flight shows while the neighbour is in one cell.
struct PlaceResidual {
  std::array<int, 2> cell{-1, -1};
  std::size_t records = 0;
  Eigen::Vector3d least_N = Eigen::Vector3d::Zero(), largest_N = Eigen::Vector3d::Zero();
};

/// Seconds over which the residual is averaged, half of them before a record: a mean without delay, so that a force is
/// told in the cell in which it acts. It passes what is slower than about 0.44/kPlaceMean_s.
inline constexpr double kPlaceMean_s = 0.1;

/// In the order of the cells; records that have no whole mean, next to a gap or a cut, are left out.
/// @param r residual in newton, one per record.
std::vector<PlaceResidual> place_residuals(const Track& track, const std::vector<Eigen::Vector3d>& r);

}  // namespace swarmcert::residuals

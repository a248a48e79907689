/// @file Range of the force residual by relative position of the neighbour, per flight.
///
/// `bound --tube --from` derives the truth model of a tube from it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Grid of the neighbour's position relative to the vehicle; place_of() selects the neighbour.
struct PlaceGrid {
  static constexpr int kLateral = 12, kHeights = 20;
  static constexpr double kLateralStep_m = 0.05, kHeightStep_m = 0.1, kLowest_m = -1;
};

/// Returns the cell [height of the neighbour above the vehicle, starting at kLowest_m; lateral distance, starting at 0]
/// of the laterally closest neighbour among those within the heights of the grid; (-1, -1) if there is none or it is
/// too far away.
std::array<int, 2> place_of(const stability::Instant& now);

/// The residual of a flight while the neighbour is in one cell.
struct PlaceResidual {
  std::array<int, 2> cell{-1, -1};
  std::size_t records = 0;
  Eigen::Vector3d least_N = Eigen::Vector3d::Zero(), largest_N = Eigen::Vector3d::Zero();
};

/// Length in seconds of the centred mean of the residual. Being centred it has no delay, so a force is assigned to the
/// cell in which it acts. It passes frequencies below about 0.44/kPlaceMean_s.
inline constexpr double kPlaceMean_s = 0.1;

/// Returns the residuals ordered by cell. Records without a complete mean (next to a gap or a cut) are skipped.
/// @param r residual in newton, one per record
std::vector<PlaceResidual> place_residuals(const Track& track, const std::vector<Eigen::Vector3d>& r);

}  // namespace swarmcert::residuals

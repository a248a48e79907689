/// @file The contribution of one track to a comparison; groups of tracks are sums of these.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "analysis/residuals/comparison.h"

namespace swarmcert::residuals {

/// One used record: residual with and without the model's effects, and its regions.
struct ResidualPoint {
  Eigen::Vector3f r, r0;
  RegionIndices regions;
  std::int16_t place[2];  ///< x and y in kPlaceStep_m, rounded down; kNoPlace if the log has no position
};
inline constexpr double kPlaceStep_m = 0.0625;
inline constexpr std::int16_t kNoPlace = std::numeric_limits<std::int16_t>::min();

/// Sums that are accumulated over groups of tracks.
struct Part {
  std::vector<ResidualPoint> points;
  std::vector<BlockSum> blocks;
  Spectrum spectrum;
  double weight_N = 0;
};

/// All results of one track.
struct TrackPart {
  TrackErrors errors;
  Part part;
  std::vector<ErrorWindow> windows;
  std::vector<Moment> moments;
  NeighbourMap neighbours;
};

/// Applies the models and evaluates both levels.
/// @param track its thrust is changed
TrackPart track_part(const Inputs& inputs, const GainsOfKinds& gains, Track& track);

/// Returns only the residual of the model: its points, regions, blocks and spectrum.
/// @param track its thrust is changed
Part residual_part(const Inputs& inputs, Track& track);

/// Returns the errors over all records of `parts`.
GroupErrors errors_of(const std::vector<const Part*>& parts);

/// Keeps only the worst few moments, worst first.
void sort_and_shorten(std::vector<Moment>& moments);

}  // namespace swarmcert::residuals

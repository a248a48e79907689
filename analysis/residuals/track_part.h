/// @file One track's contribution to a comparison; groups of tracks are sums of these.
#pragma once

#include <vector>

#include "analysis/residuals/comparison.h"

namespace swarmcert::residuals {

/// One used record: residual of the model, of the model without effects, and where it lies.
struct ResidualPoint {
  Eigen::Vector3f r, r0;
  RegionIndices regions;
};

/// Sums that groups of tracks share.
struct Part {
  std::vector<ResidualPoint> points;
  std::vector<BlockSum> blocks;
  Spectrum spectrum;
  double weight_N = 0;
};

/// Everything of one track.
struct TrackPart {
  TrackErrors errors;
  Part part;
  std::vector<ErrorWindow> windows;
  std::vector<Moment> moments;
  NeighbourMap neighbours;
};

/// Applies the models and evaluates both levels. @param track its thrust is changed.
TrackPart track_part(const Inputs& inputs, const GainsOfKinds& gains, Track& track);

/// The residual of the model alone: its points, where they lie, blocks and spectrum.
/// @param track its thrust is changed.
Part residual_part(const Inputs& inputs, Track& track);

/// Errors over all records of `parts`.
GroupErrors errors_of(const std::vector<const Part*>& parts);

/// Keeps the worst few, worst first.
void sort_and_shorten(std::vector<Moment>& moments);

}  // namespace swarmcert::residuals

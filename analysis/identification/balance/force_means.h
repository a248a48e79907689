/// @file Means of the measured specific force over stretches of a track.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::identification {

/// Between two instants of a track.
struct ForceMean {
  std::size_t first = 0, last = 0;
  Eigen::Vector3d mean_m_s2;
};

/// Over stretches of at least `length_s`, one after the other, in which nothing is cut and the track does not begin
/// anew. The trapezoidal rule integrates over the same time as the velocity changes in.
std::vector<ForceMean> specific_force_means(const residuals::Track& track, double length_s);

}  // namespace swarmcert::identification

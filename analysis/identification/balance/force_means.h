/// @file Means of the measured specific force over stretches of a track.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::identification {

/// Mean between two instants of a track.
struct ForceMean {
  std::size_t first = 0, last = 0;
  Eigen::Vector3d mean_m_s2;
};

/// Returns means over consecutive stretches of at least `length_s` without cuts or restarts of the track. The
/// trapezoidal rule integrates over exactly the time in which the velocity changes.
std::vector<ForceMean> specific_force_means(const residuals::Track& track, double length_s);

}  // namespace swarmcert::identification

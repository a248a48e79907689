/// @file Difference between the estimated velocity of a flight and the slope of its estimated position.
///
/// This is the error that the controller saw through Kd; `bound --from` uses it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/logs/log.h"
#include "analysis/residuals/learning_error.h"
#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Both velocities are means over windows of this length, so errors above about 4 Hz are not visible.
inline constexpr double kSlopeWindow_s = 0.15;

/// Returns true if a log contains both position and velocity as estimated on board, neither derived from the other.
bool measures_velocity(const logs::Log& log);

/// Returns the estimated velocity minus the slope of the estimated position, m/s, one per record: minus the slope of a
/// line fitted to p - int v dt. It is delayed by half a window, and zero within a window after a restart.
std::vector<Eigen::Vector3d> velocity_error(const Track& track);

/// Quantiles over windows, as in LearningError.
struct VelocityError {
  std::size_t windows = 0;
  LearningError::Quantiles bias_m_s;  ///< |mean| over the flight of a vehicle
  LearningError::Quantiles amplitude_m_s, rate_m_s2, variation_m_s, impulse_m;
};

/// Returns the quantiles over windows and tracks.
/// @param bias |mean| of each track
/// @param windows of all tracks
VelocityError velocity_error(const std::vector<Eigen::Vector4d>& bias,
                             const std::vector<ErrorWindow>& windows);

}  // namespace swarmcert::residuals

/// @file How far the estimated velocity of a flight is from the slope of its estimated position: what the law that flew
/// saw through Kd, read by `bound --from`.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/logs/log.h"
#include "analysis/residuals/learning_error.h"
#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Both velocities are means over windows of this length, so errors above about 4 Hz are not seen.
inline constexpr double kSlopeWindow_s = 0.15;

/// Whether a log holds position and velocity as they were estimated on board, neither derived from the other.
bool measures_velocity(const logs::Log& log);

/// Estimated velocity less the slope of the estimated position, m/s, one per record: minus the slope of a straight line
/// fitted to p - int v dt. Late by half a window; zero within a window after a restart.
std::vector<Eigen::Vector3d> velocity_error(const Track& track);

/// Quantiles over windows as those of LearningError.
struct VelocityError {
  std::size_t windows = 0;
  LearningError::Quantiles bias_m_s;  ///< |mean| over a vehicle's flight
  LearningError::Quantiles amplitude_m_s, rate_m_s2, variation_m_s, impulse_m;
};

/// @param bias |mean| of each track; @param windows of all tracks.
VelocityError velocity_error(const std::vector<Eigen::Vector4d>& bias,
                             const std::vector<ErrorWindow>& windows);

}  // namespace swarmcert::residuals

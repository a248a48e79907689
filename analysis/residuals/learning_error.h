/// @file Amplitude, rate and duration of the residual in single passes, used by `bound --from` and the gate.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/residuals/statistics.h"
#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Quantiles over windows of length kWindow_s of the residual after a low-pass of kBandwidth_hz.
struct LearningError {
  static constexpr double kWindow_s = 4.5;  ///< one pass of the published swaps
  static constexpr double kBandwidth_hz = 5;
  struct Quantiles {
    Axes p50, p95, p99, max;
  };
  std::size_t windows = 0;
  Quantiles bias_N;       ///< |mean| over the flight of a vehicle
  Quantiles amplitude_N;  ///< largest value
  Quantiles rate_N_s;     ///< largest rate of change
  Quantiles variation_N;  ///< total variation
  Quantiles impulse_N_s;  ///< integral of the absolute value
};

/// The error in one window, for x, y, z and the vector.
struct ErrorWindow {
  Eigen::Vector4d amplitude, rate, variation, impulse;
};

/// Splits the used records of a track into windows. A window ends early at a gap or cut; short windows are dropped.
/// @param r residual in newton, one per record
std::vector<ErrorWindow> error_windows(const Track& track, const std::vector<Eigen::Vector3d>& r);

/// Returns the quantiles over windows and tracks.
/// @param bias |mean| of each track
/// @param windows of all tracks
LearningError learning_error(const std::vector<Eigen::Vector4d>& bias,
                             const std::vector<ErrorWindow>& windows);

/// Returns quantiles of each component.
LearningError::Quantiles quantiles(const std::vector<Eigen::Vector4d>& values);

/// Returns the absolute values of the components, followed by the norm.
Eigen::Vector4d with_norm(const Eigen::Vector3d& v);

}  // namespace swarmcert::residuals

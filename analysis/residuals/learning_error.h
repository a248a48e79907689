/// @file Amplitude, rate and duration of the residual in single passes, read by `bound --from` and the gate.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/residuals/statistics.h"
#include "analysis/residuals/track.h"

namespace swarmcert::residuals {

/// Quantiles over windows of kWindow_s of the residual behind a low-pass of kBandwidth_hz.
struct LearningError {
  static constexpr double kWindow_s = 4.5;  ///< one pass of the published swaps
  static constexpr double kBandwidth_hz = 5;
  struct Quantiles {
    Axes p50, p95, p99, max;
  };
  std::size_t windows = 0;
  Quantiles bias_N;       ///< |mean| over a vehicle's flight
  Quantiles amplitude_N;  ///< largest value
  Quantiles rate_N_s;     ///< largest rate of change
  Quantiles variation_N;  ///< total variation
  Quantiles impulse_N_s;  ///< integral of the absolute value
};

/// What one window shows, of x, y, z and the vector.
struct ErrorWindow {
  Eigen::Vector4d amplitude, rate, variation, impulse;
};

/// Windows of the used records of one track. A window ends early at every gap or cut; short ones are dropped.
/// @param r residual in newton, one per record.
std::vector<ErrorWindow> error_windows(const Track& track, const std::vector<Eigen::Vector3d>& r);

/// @param bias |mean| of each track; @param windows of all tracks.
LearningError learning_error(const std::vector<Eigen::Vector4d>& bias,
                             const std::vector<ErrorWindow>& windows);

/// Quantiles of each component.
LearningError::Quantiles quantiles(const std::vector<Eigen::Vector4d>& values);

/// Absolute values, and the length.
Eigen::Vector4d with_norm(const Eigen::Vector3d& v);

}  // namespace swarmcert::residuals

/// @file Statistics of residuals, in newton.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::residuals {

/// One number per axis and one for the vector.
struct Axes {
  double x = 0, y = 0, z = 0, total = 0;
};

/// Statistics of residuals r and of the residuals r0 without the model's effects.
struct ErrorStatistics {
  std::size_t samples = 0;
  Axes rmse;                ///< total: root mean square of |r|
  Axes bias;                ///< mean; total: length of the mean vector
  Axes p95, p999, max;      ///< quantiles of the absolute value; total: of |r|
  Axes variance_explained;  ///< 1 - var(r) / var(r0); 0 if r0 is constant
};

/// Returns the statistics.
/// @param r, r0 in newton, for the same records
ErrorStatistics statistics(const std::vector<Eigen::Vector3f>& r, const std::vector<Eigen::Vector3f>& r0);

struct BlockSum {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double count = 0;
};
/// Returns 90 % bootstrap intervals of the root mean square for x, y, z and total, by resampling blocks; nothing for
/// fewer than five blocks, which say too little about others.
std::optional<std::array<Interval, 4>> bootstrap_rmse(const std::vector<BlockSum>& blocks,
                                                      std::uint64_t seed);

/// Returns the `p` quantile of `values`; 0 if empty. Reorders `values`.
double quantile(std::vector<double>& values, double p);
double quantile(std::vector<float>& values, double p);

/// A frequency at which much of a residual is concentrated, as in a vibration.
struct SpectralLine {
  double frequency_hz = 0;  ///< 0: none
  int axis = 0;
  double share = 0;  ///< of the power of this axis

  bool is_found() const { return frequency_hz > 0; }
};

/// Average power spectrum of a residual per axis, from Hann windows of 256 records.
class Spectrum {
 public:
  /// Adds a piece of a residual.
  /// @param residual [records], consecutive, without gaps
  /// @param period_s mean time between records
  /// @param passes fraction of the power passed by an earlier window, by frequency in hertz; empty: all of it. Both
  ///   bands are divided by it, because a mean over 100 ms attenuates the noise floor but not the low band.
  void add(const std::vector<Eigen::Vector3d>& residual, double period_s,
           const std::function<double(double)>& passes = {});
  void add(const Spectrum& other);
  /// Returns the mean power in 0.3 .. 4 Hz divided by the median power in 12 .. 25 Hz, of which slower logs have only
  /// a lower part: about 1 if only white noise is left. NaN if no piece was long enough.
  Eigen::Vector3d low_band_to_floor() const;
  /// Above this ratio, slow disturbances are left.
  static constexpr double kSlowToFloor = 3;
  /// Returns the root of the power of the white noise floor over all frequencies, N rms: what no model can explain.
  Eigen::Vector3d noise_floor_N() const;
  /// Returns the frequency above the low band, 4 Hz, whose five neighbouring frequencies of the spectrum hold the
  /// largest share of the power of their axis, if that is a quarter or more and they exceed the median of the axis
  /// tenfold. In white noise they hold 4 %.
  SpectralLine line() const;

 private:
  static constexpr int kWindow = 256;
  Eigen::Matrix3d median_and_mean() const;
  Eigen::Matrix<double, 3, kWindow / 2> power_ = Eigen::Matrix<double, 3, kWindow / 2>::Zero();
  Eigen::Array<double, kWindow / 2, 1> passed_ =
      Eigen::Array<double, kWindow / 2, 1>::Zero();  ///< sum over windows
  double windows_ = 0, period_sum_s_ = 0;
};

}  // namespace swarmcert::residuals

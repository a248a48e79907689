/// @file Statistics of residuals, in newton.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::residuals {

/// One number per axis and for the vector.
struct Axes {
  double x = 0, y = 0, z = 0, total = 0;
};

/// Of residuals r and of what the model without effects leaves, r0.
struct ErrorStatistics {
  std::size_t samples = 0;
  Axes rmse;                ///< total: root mean square of |r|
  Axes bias;                ///< mean; total: length of the mean vector
  Axes p95, p999, max;      ///< quantiles of the absolute value; total: of |r|
  Axes variance_explained;  ///< 1 - var(r) / var(r0); 0 where r0 does not vary
};

/// @param r, r0 in newton, of the same records.
ErrorStatistics statistics(const std::vector<Eigen::Vector3f>& r, const std::vector<Eigen::Vector3f>& r0);

struct BlockSum {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double count = 0;
};
/// 90 % interval of the root mean square by resampling blocks, for x, y, z and total; equal ends where there are fewer
/// than two blocks.
std::array<Interval, 4> bootstrap_rmse(const std::vector<BlockSum>& blocks, std::uint64_t seed);

/// Value below which a share `p` of `values` lies; 0 if empty. Reorders `values`.
double quantile(std::vector<double>& values, double p);
double quantile(std::vector<float>& values, double p);

/// Average power spectrum per axis of the pieces of a residual, from Hann windows of 256 records.
class Spectrum {
 public:
  /// @param residual [records], consecutive, without gaps; `period_s` their mean distance.
  /// @param passes power that a window let pass before, by frequency in hertz; empty: all of it. Both bands are divided
  /// by it: a mean over 100 ms hides the floor, not what is above it.
  void add(const std::vector<Eigen::Vector3d>& residual, double period_s,
           const std::function<double(double)>& passes = {});
  void add(const Spectrum& other);
  /// Mean power in 0.3 .. 4 Hz over median power in 12 .. 25 Hz: about 1 where nothing but white noise is left.
  /// NaN where no piece was long enough.
  Eigen::Vector3d low_band_to_floor() const;
  /// Root of the white floor's power over all frequencies, N rms: what no model can remove.
  Eigen::Vector3d noise_floor_N() const;

 private:
  static constexpr int kWindow = 256;
  Eigen::Matrix3d median_and_mean() const;
  Eigen::Matrix<double, 3, kWindow / 2> power_ = Eigen::Matrix<double, 3, kWindow / 2>::Zero();
  Eigen::Array<double, kWindow / 2, 1> passed_ =
      Eigen::Array<double, kWindow / 2, 1>::Zero();  ///< sum over windows
  double windows_ = 0, period_sum_s_ = 0;
};

}  // namespace swarmcert::residuals

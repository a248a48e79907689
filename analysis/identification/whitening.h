/// @file Noise of a force residual that is correlated in time, and the filter that makes it white.
///
/// A gust that forgets itself, beside white noise: r = g + w with corr(g(t), g(t + d)) = exp(-d / forget_s). One record
/// to the next this is an ARMA(1, 1) process with the innovations e_t = r_t - phi r_(t-1) + theta e_(t-1).
///
/// Where a controller answers gusts, least squares take the answer for a lag of the thrust. Thrust responds to past
/// disturbances only, so it is uncorrelated with later innovations: least squares of filtered residuals on filtered
/// columns are consistent in a closed loop if the noise is of this kind (direct identification: Ljung, System
/// Identification, 1999, 13.4).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace swarmcert::identification {

struct Noise {
  double forget_s = 0;     ///< of the gusts
  double white_share = 0;  ///< variance of the white noise over that of the gusts
};

/// Sums of products of a residual with itself, a tenth and two tenths of a second later.
struct Autocovariance {
  static constexpr double kStep_s = 0.1;
  double sums[3] = {};
  double counts[3] = {};

  /// @param values at times `step` records of which make kStep_s; restarts[i] != 0 where record i does not follow.
  void add(const std::vector<double>& values, const std::vector<char>& restarts, std::size_t step);
  /// forget_s is 0, and no filter is needed, where the correlation over a tenth of a second is below 0.1.
  Noise noise() const;
};

/// The filter, for many signals side by side.
class Whitening {
 public:
  explicit Whitening(const Noise& noise) : noise_(noise) {}
  /// @param x       one sample of every signal.
  /// @param dt_s    since the sample before.
  /// @param restart nothing is known of the past: the innovation is 0.
  const Eigen::Matrix3Xd& advance(const Eigen::Matrix3Xd& x, double dt_s, bool restart);

 private:
  void tune(double dt_s);

  Noise noise_;
  double dt_s_ = 0, phi_ = 0, theta_ = 0;
  Eigen::Matrix3Xd last_, innovation_;
};

}  // namespace swarmcert::identification

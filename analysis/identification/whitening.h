/// @file A model of the time-correlated noise of a force residual, and the filter that whitens it.
///
/// The model is a gust with exponential correlation plus white noise: r = g + w with
/// corr(g(t), g(t + d)) = exp(-d / forget_s). From record to record this is an ARMA(1, 1) process with the innovations
/// e_t = r_t - phi r_(t-1) + theta e_(t-1).
///
/// If a controller reacts to gusts, least squares mistake the reaction for a lag of the thrust. Thrust responds only to
/// past disturbances, so it is uncorrelated with later innovations: least squares of filtered residuals on filtered
/// columns are consistent in closed loop if the noise is of this kind (direct identification: Ljung, System
/// Identification, 1999, 13.4).
///
/// A vibration is not of this kind: the past predicts it, and the thrust follows it through the measured velocity.
/// Columns and residual then pass a notch filter at its frequency first.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace swarmcert::identification {

struct Noise {
  double forget_s = 0;     ///< correlation time of the gusts
  double white_share = 0;  ///< variance of the white noise over that of the gusts
  double line_hz = 0;      ///< frequency of a vibration; 0: none

  bool is_white() const { return !(forget_s > 0) && !(line_hz > 0); }
};

/// Removes a band of 1 Hz about a frequency from many signals at once: a filter of second order with zeros on the unit
/// circle and poles at the distance exp(-pi (1 Hz) dt) from the origin.
class Notch {
 public:
  explicit Notch(double frequency_hz) : frequency_hz_(frequency_hz) {}
  /// Advances the filter by one sample.
  /// @param x       one sample of each signal
  /// @param dt_s    time since the previous sample
  /// @param restart the past is unknown: x is taken for a constant
  const Eigen::Matrix3Xd& advance(const Eigen::Matrix3Xd& x, double dt_s, bool restart);

 private:
  double frequency_hz_;
  Eigen::Matrix3Xd x_[2], y_[2], out_;  ///< the last two samples, newest first
};

/// Sums of products of a residual with itself, undelayed and delayed by one and two tenths of a second.
struct Autocovariance {
  static constexpr double kStep_s = 0.1;
  double sums[3] = {};
  double counts[3] = {};

  /// @param values with `step` records per kStep_s; restarts[i] != 0: record i does not follow the previous one
  void add(const std::vector<double>& values, const std::vector<char>& restarts, std::size_t step);
  /// Returns the noise. forget_s is 0, and no filter is needed, if the correlation over 0.1 s is below 0.1.
  Noise noise() const;
};

/// The whitening filter for many signals at once.
class Whitening {
 public:
  explicit Whitening(const Noise& noise) : noise_(noise), notch_(noise.line_hz) {}
  /// Advances the filter by one sample and returns the innovations.
  /// @param x       one sample of each signal
  /// @param dt_s    time since the previous sample
  /// @param restart the past is unknown: the innovation is 0, or the sample without gusts in the noise
  const Eigen::Matrix3Xd& advance(const Eigen::Matrix3Xd& x, double dt_s, bool restart);

 private:
  void tune(double dt_s);

  Noise noise_;
  Notch notch_;
  double dt_s_ = 0, phi_ = 0, theta_ = 0;
  Eigen::Matrix3Xd last_, innovation_;
};

}  // namespace swarmcert::identification

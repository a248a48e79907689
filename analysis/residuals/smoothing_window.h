/// @file The weighted mean of the acceleration over a window implied by differentiating a logged velocity or position.
///
/// The slope of a line fitted to a velocity is a mean of the acceleration with parabolic weights; the curvature of a
/// parabola fitted to a position is a mean with weights of fourth order. To give both sides of the force balance the
/// same mean, the model's force is integrated once or twice and passed through the same fit. The window ends at the
/// current record, so like a filter it delays both sides by half its length.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::residuals {

/// Returns the fraction of the power at `frequency_hz` passed by the mean; 1 if `source` is not a derivative.
double power_passed(logs::ForceSource source, double length_s, double frequency_hz);

class SmoothingWindow {
 public:
  /// @param source   kVelocity: first derivative; kPosition: second derivative
  /// @param channels number of signals processed together, each with three axes
  SmoothingWindow(logs::ForceSource source, double length_s, int channels);

  void restart();

  /// Replaces forces, assumed linear between records, by their mean over the window.
  /// @param values [3 x channels]
  void average(double time_s, Eigen::Ref<Eigen::Matrix3Xd> values);
  /// Replaces a velocity or position by its derivative over the window, i.e. by average() of the underlying
  /// acceleration. Zero for the first records after a restart.
  void differentiate(double time_s, Eigen::Ref<Eigen::Matrix3Xd> values);

 private:
  const int order_;
  const double length_s_;
  bool has_past_ = false;
  double last_s_ = 0;
  Eigen::Matrix3Xd last_, once_, twice_;  ///< force and its integrals at the last record
  std::vector<double> times_s_;           ///< of the columns of history_, from first_ on
  Eigen::MatrixXd history_;               ///< [3 channels x records]
  std::size_t first_ = 0;
};

}  // namespace swarmcert::residuals

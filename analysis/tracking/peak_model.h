/// @file How large the tracking error of a flight gets, from the parts of its bound: a regression with non-negative
/// weights, so that the prediction never falls where a part rises, and a conformal multiplier on top.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "analysis/tracking/conformal.h"

namespace swarmcert::analysis {

/// One axis of one flight.
struct FlownPeak {
  std::string group;   ///< flights that share what is varied, e.g. the gains
  double peak_m = 0;   ///< flown; positive
  double known_m = 0;  ///< part of the error that is known beforehand
  std::vector<double>
      parts;  ///< m per unit of their disturbance, at least zero; infinite where the loop is unstable
};

/// peak = known + sum of weight * part. The weights are the sizes of the disturbances.
struct PeakModel {
  std::vector<double> weights;  ///< at least zero; as many as parts
  std::vector<double> largest;  ///< of each part among the flights fitted to; infinite ones count as these
  ConformalThreshold promise;   ///< its threshold multiplies the prediction

  double predicted_m(const FlownPeak& flight) const;
  double bound_m(const FlownPeak& flight) const { return promise.threshold * predicted_m(flight); }
  /// Whether a part exceeds all that the weights were fitted to: then nothing is promised.
  bool extrapolates(const FlownPeak& flight) const;
};

/// Weights w >= 0 that minimise the sum over groups of the mean over their flights of huber(log(predicted/peak)), by
/// non-negative least squares in turn with the weights of Huber's loss.
std::vector<double> fit_peak_weights(const std::vector<FlownPeak>& flights,
                                     const std::vector<double>& largest);

/// Fits all flights; the score of a flight is its peak over the prediction of a fit that has not seen its group
/// (five folds of groups), so the threshold is that of cross-conformal prediction: where weights hardly differ
/// between folds, that of split-conformal prediction.
/// @param level of the promise. @throws std::invalid_argument as conformal_threshold().
PeakModel calibrate_peaks(const std::vector<FlownPeak>& flights, double level);

/// min over x >= 0 of |Ax - b|, given G = A'A and f = A'b, by Lawson and Hanson's active sets.
Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& G, const Eigen::VectorXd& f);

}  // namespace swarmcert::analysis

/// @file Prediction of the largest tracking error of a flight from the parts of its bound: a regression with
/// non-negative weights, so that the prediction never decreases when a part increases, and a conformal multiplier.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "analysis/tracking/conformal.h"

namespace swarmcert::analysis {

/// One axis of one flight.
struct FlownPeak {
  std::string group;   ///< flights with the same setting of what is varied, e.g. the gains
  double peak_m = 0;   ///< measured in flight; positive
  double known_m = 0;  ///< part of the error known beforehand
  std::vector<double>
      parts;  ///< m per unit of their disturbance, non-negative; infinite if the loop is unstable
};

/// peak = known + sum of weight * part. The weights are the sizes of the disturbances.
struct PeakModel {
  std::vector<double> weights;  ///< non-negative; one per part
  std::vector<double> largest;  ///< maximum of each part over the fitted flights; replaces infinite parts
  ConformalThreshold promise;   ///< the threshold multiplies the prediction

  double predicted_m(const FlownPeak& flight) const;
  double bound_m(const FlownPeak& flight) const { return promise.threshold * predicted_m(flight); }
  /// Whether a part exceeds its range in the fit, in which case nothing is promised.
  bool extrapolates(const FlownPeak& flight) const;
};

/// Returns weights w >= 0 that minimise the sum over groups of the mean over their flights of
/// huber(log(predicted/peak)), by non-negative least squares, iteratively reweighted for Huber's loss.
std::vector<double> fit_peak_weights(const std::vector<FlownPeak>& flights,
                                     const std::vector<double>& largest);

/// Fits all flights. The score of a flight is its peak over the prediction of a fit without its group (five folds of
/// groups), so the threshold is that of cross-conformal prediction; if the weights hardly differ between folds, it is
/// that of split-conformal prediction.
/// @param level probability of the promise.
/// @throws std::invalid_argument as conformal_threshold().
PeakModel calibrate_peaks(const std::vector<FlownPeak>& flights, double level);

/// Returns the minimiser of |Ax - b| over x >= 0, given G = A'A and f = A'b, by the active-set method of Lawson and
/// Hanson.
Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& G, const Eigen::VectorXd& f);

}  // namespace swarmcert::analysis

/// @file Data and columns in numbers of variance 1: of what set points can have caused, or of everything.
#pragma once

#include "analysis/identification/evidence/hypotheses.h"

namespace swarmcert::evidence {

class Projection {
 public:
  /// On an orthonormal basis of the instruments: some hundred numbers per axis, in which a disturbance is noise and the
  /// vehicle's answer to it has no part. The noise is estimated from the rest of the data, which no effect of the set
  /// points reaches.
  /// Precondition: there are instruments.
  static Projection on_set_points(const Hypotheses& all);
  /// On all coefficients.
  /// @param power of the noise, N^2, by cell of NoiseModel
  static Projection on_everything(const Hypotheses& all, const Eigen::VectorXd& power);

  /// Returns columns divided by the standard deviation of the noise, axis below axis, [numbers x columns].
  Eigen::MatrixXf of(const Columns& columns) const;
  Eigen::VectorXf of(const std::array<Eigen::VectorXf, 3>& series) const;

 private:
  bool is_on_basis_ = false;
  /// By axis: the basis divided by the standard deviations, [rows x numbers]; or their inverses, [rows x 1].
  std::array<Eigen::MatrixXf, 3> weighted_;
};

/// Returns the power of the noise by cell, if the residual is noise beside these columns with their coefficients.
Eigen::VectorXd power_beside(const Hypotheses& all, const std::vector<int>& columns,
                             const Eigen::VectorXd& coefficients);

}  // namespace swarmcert::evidence

/// @file The linear system of an interior-point step for a RankTwoInequality. Not for users.
#pragma once

#include <Eigen/Core>

#include "lipschitz/solver/interior_point.h"

namespace swarmcert::lipschitz {

/// Returns the vector of <A_j, X> for symmetric X, given X A (see RankTwoInequality::times_a).
Eigen::VectorXd functionals(const RankTwoInequality& it, const Eigen::MatrixXd& x,
                            const Eigen::MatrixXd& x_a);

/// Returns M_ij = <A_i, Z A_j Y> for symmetric Z and Y, given Z A and Y A. Each A_j has rank two, so this costs a few
/// matrix products instead of one per pair of constraints.
Eigen::MatrixXd schur_complement(const RankTwoInequality& it, const Eigen::MatrixXd& z,
                                 const Eigen::MatrixXd& z_a, const Eigen::MatrixXd& y,
                                 const Eigen::MatrixXd& y_a);

/// Solves M v = rhs for a symmetric positive definite M that may be badly scaled.
class SchurSolver {
 public:
  explicit SchurSolver(const Eigen::MatrixXd& schur);
  /// Returns false if M is not positive definite in floating point, even after adding 1e-7 of its diagonal.
  bool good() const { return factor_.size() > 0 && scale_.allFinite(); }
  Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;

 private:
  Eigen::VectorXd scale_;
  Eigen::MatrixXd scaled_, factor_;
};

}  // namespace swarmcert::lipschitz

/// @file Least squares with bounds on each coefficient.
#pragma once

#include <Eigen/Core>

namespace swarmcert::identification {

/// Returns argmin y - 2 c'b + c'Gc subject to lower <= c <= upper. Active-set method: violated bounds are fixed, and
/// released when the gradient points inwards. Coefficients of columns without information are 0.
/// @param gram [n x n] positive semidefinite; b, lower, upper [n]; lower <= upper, infinite if unbounded
Eigen::VectorXd box_least_squares(const Eigen::MatrixXd& gram, const Eigen::VectorXd& b,
                                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

}  // namespace swarmcert::identification

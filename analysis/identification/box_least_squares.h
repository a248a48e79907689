/// @file Least squares with bounds on every coefficient.
#pragma once

#include <Eigen/Core>

namespace swarmcert::identification {

/// argmin y - 2 c'b + c'Gc within lower <= c <= upper. Active set: violated bounds are fixed, and released where the
/// gradient points inside. Columns that say nothing get 0.
/// @param gram [n x n] positive semidefinite; b, lower, upper [n]. lower <= upper; infinite where free.
Eigen::VectorXd box_least_squares(const Eigen::MatrixXd& gram, const Eigen::VectorXd& b,
                                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

}  // namespace swarmcert::identification

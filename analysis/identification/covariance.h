/// @file Covariance of coefficients for errors that are correlated within and between neighbouring blocks.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/identification/block_grams.h"

namespace swarmcert::identification {

/// Returns the covariance of the least squares coefficients `c` of the columns `free`, robust to correlation within
/// blocks and between neighbouring blocks (Bartlett weight 1/2, Newey and West 1987). Rows and columns of the other
/// coefficients are zero.
/// @param ridge added to the diagonal of G, [columns] or empty
Eigen::MatrixXd sandwich(const std::vector<Block>& blocks, const std::vector<int>& free,
                         const Eigen::VectorXd& c, const Eigen::VectorXd& ridge = {});

/// Estimates the variance of the sum of `influences`, one per block, assuming that their correlation decays as in a
/// first-order process: sum of squares times (1 + rho) / (1 - rho) (Andrews 1991), where rho is the correlation of
/// consecutive blocks, corrected for its bias -(1 + 3 rho) / n (Kendall 1954) and clamped to at least 0, so that
/// alternating blocks do not reduce the variance. For 20 independent blocks the estimate is about a tenth too large.
/// @param follows whether a block directly follows the previous one, [influences]
double long_run_variance(const std::vector<double>& influences, const std::vector<char>& follows);

/// Variances for intervals; the influence of a block is measured by leaving it out.
struct Jackknife {
  Eigen::VectorXd variance;  ///< 0 for columns that are not free
  /// Degrees of freedom of Student's distribution: the effective number of blocks that carry information on a
  /// coefficient, minus one. It is small for an effect that acts in few blocks.
  Eigen::VectorXd freedom;
};

/// Returns long_run_variance() of the influences (G - G_b)^-1 (b_b - G_b c) of the blocks b; G^-1 (b_b - G_b c) would
/// be too small if a block carries much of the information on a coefficient (MacKinnon and White 1985, HC3). Degrees of
/// freedom: n_eff - 1 with n_eff = (sum h_b)^2 / sum h_b^2, where h_b is the diagonal of G^-1 G_b G^-1.
Jackknife jackknife(const std::vector<Block>& blocks, const std::vector<int>& free, const Eigen::VectorXd& c,
                    const Eigen::VectorXd& ridge = {});

/// Returns the mean difference of two lists of errors divided by its standard error.
double paired_z(const std::vector<double>& before, const std::vector<double>& after);

}  // namespace swarmcert::identification

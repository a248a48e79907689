/// @file Covariance of coefficients under errors correlated within a block and between neighbouring blocks.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/identification/block_grams.h"

namespace swarmcert::identification {

/// Covariance of least-squares coefficients `c` of the columns `free`, robust to correlation within blocks and between
/// neighbouring ones (Bartlett weight 1/2, Newey and West 1987). Rows and columns of the others are zero.
/// @param ridge added to the diagonal of G, [columns] or empty.
Eigen::MatrixXd sandwich(const std::vector<Block>& blocks, const std::vector<int>& free,
                         const Eigen::VectorXd& c, const Eigen::VectorXd& ridge = {});

/// Variance of the sum of `influences`, one per block, whose correlation dies away like that of a process of first
/// order: sum of squares times (1 + rho) / (1 - rho) (Andrews 1991), rho the correlation of blocks of which one follows
/// the other, less its bias -(1 + 3 rho) / n (Kendall 1954), and no less than 0: no credit for blocks that seem to
/// alternate. An estimate: independent blocks give about a tenth more than they should where there are 20.
/// @param follows true where a block follows the one before it, [influences].
double long_run_variance(const std::vector<double>& influences, const std::vector<char>& follows);

/// For intervals: what a block weighs is measured by leaving it out.
struct Jackknife {
  Eigen::VectorXd variance;  ///< 0 of columns that are not free
  /// Of Student's distribution: blocks that carry a coefficient's information, less one. An effect that acts in few
  /// blocks has few.
  Eigen::VectorXd freedom;
};

/// long_run_variance() of the influence (G - G_b)^-1 (b_b - G_b c) of each block b; G^-1 (b_b - G_b c) would be too
/// small where a block carries much of a coefficient (MacKinnon and White 1985, HC3). Freedom: n_eff - 1 with
/// n_eff = (sum h_b)^2 / sum h_b^2 and h_b the diagonal of G^-1 G_b G^-1.
Jackknife jackknife(const std::vector<Block>& blocks, const std::vector<int>& free, const Eigen::VectorXd& c,
                    const Eigen::VectorXd& ridge = {});

/// Mean difference of two lists of errors over its standard error.
double paired_z(const std::vector<double>& before, const std::vector<double>& after);

}  // namespace swarmcert::identification

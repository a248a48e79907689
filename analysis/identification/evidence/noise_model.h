/// @file Power of the noise over frequency: white noise, differentiated white noise, and gusts of any time scale.
///
/// S(f) = sum_k a_k L_k(f), a_k >= 0, with L = 1, f^2, f^4 and Ornstein-Uhlenbeck spectra 1 / (1 + (2 pi f tau)^2) of
/// six times from 20 ms to 6 s. There is no case for gusts, vibrations or calm air.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/identification/evidence/spectral.h"

namespace swarmcert::evidence {

/// A cell is a band of one axis; each axis of each sampling is a channel with its own shares a_k.
class NoiseModel {
 public:
  static constexpr int kShapes = 9;

  /// @param floor_N2 smallest variance of each axis that sensors allow; shares far below it are of no interest
  NoiseModel(const std::vector<Band>& bands, const Eigen::Vector3d& floor_N2);

  /// Returns S of each cell, N^2 per coefficient: the estimate of largest likelihood, with a weak prior of the shares.
  /// @param squares_N2 sum of the squared coefficients of each cell, axis by axis
  /// @param counts     how many independent coefficients this sum has
  Eigen::VectorXd power(const Eigen::VectorXd& squares_N2, const Eigen::VectorXd& counts) const;
  /// Returns the number of coefficients of each cell.
  const Eigen::VectorXd& counts() const { return counts_; }

 private:
  struct Channel {
    int first = 0, count = 0;  ///< cells
    double floor_N2 = 0;
    Eigen::Matrix<double, kShapes, Eigen::Dynamic> shapes;
  };
  using Shares = Eigen::Matrix<double, kShapes, 1>;  ///< ln a
  /// Returns shares that suit the median power, before any fit.
  static Shares start(const Channel& channel, const Eigen::VectorXd& squares_N2,
                      const Eigen::VectorXd& counts);
  /// Takes a step of Fisher scoring.
  static void improve(const Channel& channel, const Eigen::VectorXd& squares_N2,
                      const Eigen::VectorXd& counts, Shares& shares);

  std::vector<Channel> channels_;
  Eigen::VectorXd counts_;
};

}  // namespace swarmcert::evidence

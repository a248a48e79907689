/// @file Free curves over a variable, the competitors of every named effect.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace swarmcert::evidence {

/// Cubic B-splines with equidistant knots over the middle 99 % of a variable's values; constant outside.
class Curve {
 public:
  static constexpr int kSize = 8;
  using Values = Eigen::Matrix<double, kSize, 1>;

  /// @param values of the variable in flight; not empty, reordered
  explicit Curve(std::vector<double>& values);

  /// Returns whether the variable varies at all.
  bool varies() const { return upper_ > lower_; }
  Values operator()(double value) const;

  /// Returns D'D of the second differences D of the coefficients.
  static Eigen::Matrix<double, kSize, kSize> roughness();

 private:
  double lower_ = 0, upper_ = 0;
};

}  // namespace swarmcert::evidence

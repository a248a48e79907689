/// @file Columns and residual in numbers of variance 1, with the products that a search needs.
#pragma once

#include <Eigen/Core>
#include <map>
#include <utility>

namespace swarmcert::evidence {

/// The normal equations of a set: products of its columns with each other and with the data.
struct Normal {
  Eigen::MatrixXd gram;  ///< X'X
  Eigen::VectorXd b;     ///< X'y
};

/// Columns X and data y whose noise has variance 1. Products are formed when a search needs them, and kept. Not
/// thread-safe.
class Whitened {
 public:
  /// @param columns [numbers x columns]
  /// @throws std::domain_error if a number is not finite
  Whitened(Eigen::MatrixXf columns, Eigen::VectorXf data);

  /// Adds columns behind the others.
  void append(const Eigen::MatrixXf& columns);

  const Eigen::MatrixXf& columns() const { return columns_; }
  const Eigen::VectorXf& data() const { return data_; }
  /// X'y and y'y.
  const Eigen::VectorXd& with_data() const { return with_data_; }
  double data_square() const { return data_square_; }
  /// Returns the products of `size` columns from `first` with all columns, [columns x size].
  const Eigen::MatrixXd& with_all(int first, int size) const;
  /// Returns those of `size` columns from `first` with each other.
  const Eigen::MatrixXd& within(int first, int size) const;

 private:
  Eigen::MatrixXf columns_;
  Eigen::VectorXf data_;
  Eigen::VectorXd with_data_;
  double data_square_;
  mutable std::map<int, Eigen::MatrixXd> with_all_, within_;
};

}  // namespace swarmcert::evidence

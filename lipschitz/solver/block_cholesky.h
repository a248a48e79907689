/// @file Cholesky factors of block tridiagonal matrices, whose cost grows linearly with the number of blocks.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace swarmcert::lipschitz {

/// L with S = L L', where S is symmetric and block tridiagonal, so that L has a diagonal block and one left of it per
/// block row. Floating point: nothing that rests on it is trusted.
class BlockCholesky {
 public:
  /// @param begin first index of each block, ascending from 0; its last entry is the size of S.
  /// @returns nothing if the factorisation breaks down, so S is not safely positive definite.
  static std::optional<BlockCholesky> of(const Eigen::MatrixXd& s, const std::vector<Eigen::Index>& begin);

  /// X <- X S^-1.
  void divide(Eigen::MatrixXd& x) const;
  /// S^-1, dense.
  Eigen::MatrixXd inverse() const;
  /// L^-1 D L^-T v, for symmetric D with the blocks of S.
  Eigen::VectorXd congruence_times(const Eigen::MatrixXd& d, const Eigen::VectorXd& v) const;

 private:
  std::size_t blocks() const { return diagonal_.size(); }
  Eigen::Index width(std::size_t k) const { return begin_[k + 1] - begin_[k]; }

  std::vector<Eigen::Index> begin_;
  std::vector<Eigen::MatrixXd> diagonal_;  ///< lower triangular
  std::vector<Eigen::MatrixXd> left_;  ///< of block row k, in the columns of block k - 1; the first is empty
};

}  // namespace swarmcert::lipschitz

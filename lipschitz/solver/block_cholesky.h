/// @file Cholesky factors of block tridiagonal matrices, with cost linear in the number of blocks.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace swarmcert::lipschitz {

/// The factor L of S = L L', where S is symmetric and block tridiagonal. Each block row of L has a diagonal block and
/// one block to its left. Computed in floating point: results are not trusted.
class BlockCholesky {
 public:
  /// Factorises S.
  /// @param begin first index of each block, ascending from 0; the last entry is the size of S.
  /// @returns nothing if the factorisation breaks down, which means that S is not safely positive definite.
  static std::optional<BlockCholesky> of(const Eigen::MatrixXd& s, const std::vector<Eigen::Index>& begin);

  /// X <- X S^-1.
  void divide(Eigen::MatrixXd& x) const;
  /// Returns S^-1 as a dense matrix.
  Eigen::MatrixXd inverse() const;
  /// Returns L^-1 D L^-T v for a symmetric D with the block pattern of S.
  Eigen::VectorXd congruence_times(const Eigen::MatrixXd& d, const Eigen::VectorXd& v) const;

 private:
  std::size_t blocks() const { return diagonal_.size(); }
  Eigen::Index width(std::size_t k) const { return begin_[k + 1] - begin_[k]; }

  std::vector<Eigen::Index> begin_;
  std::vector<Eigen::MatrixXd> diagonal_;  ///< lower triangular
  std::vector<Eigen::MatrixXd> left_;      ///< block (k, k - 1) of each block row k; the first is empty
};

}  // namespace swarmcert::lipschitz

#include "lipschitz/solver/block_cholesky.h"

#include <algorithm>

#include "lipschitz/solver/dense_kernels.h"

namespace swarmcert::lipschitz {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::optional<BlockCholesky> BlockCholesky::of(const MatrixXd& s, const std::vector<Index>& begin) {
  BlockCholesky result;
  result.begin_ = begin;
  for (std::size_t k = 0; k + 1 < begin.size(); ++k) {
    const Index width = begin[k + 1] - begin[k];
    MatrixXd diagonal = s.block(begin[k], begin[k], width, width);
    MatrixXd left;
    if (k > 0) {  // S_k,k-1 = B L_k-1', and S_kk = B B' + L_k L_k'
      const Index before = begin[k] - begin[k - 1];
      left = s.block(begin[k], begin[k - 1], width, before);
      divide_by_lower_transposed(left, result.diagonal_.back());
      add_product_transposed(diagonal, -left, left);
    }
    diagonal = cholesky(diagonal);
    if (diagonal.size() == 0) return std::nullopt;
    result.diagonal_.push_back(std::move(diagonal));
    result.left_.push_back(std::move(left));
  }
  return result;
}

void BlockCholesky::divide(MatrixXd& x) const {
  for (std::size_t k = 0; k < blocks(); ++k) {  // U L' = X
    auto columns = x.middleCols(begin_[k], width(k));
    if (k > 0) add_product_transposed(columns, x.middleCols(begin_[k - 1], width(k - 1)), -left_[k]);
    divide_by_lower_transposed(columns, diagonal_[k]);
  }
  for (std::size_t k = blocks(); k-- > 0;) {  // V L = U
    auto columns = x.middleCols(begin_[k], width(k));
    if (k + 1 < blocks()) add_product(columns, x.middleCols(begin_[k + 1], width(k + 1)), -left_[k + 1]);
    divide_by_lower(columns, diagonal_[k]);
  }
}

MatrixXd BlockCholesky::inverse() const {
  MatrixXd result = MatrixXd::Identity(begin_.back(), begin_.back());
  divide(result);
  return 0.5 * (result + MatrixXd(result.transpose()));
}

VectorXd BlockCholesky::congruence_times(const MatrixXd& d, const VectorXd& v) const {
  VectorXd u = v;
  for (std::size_t k = blocks(); k-- > 0;) {  // L' u = v
    auto part = u.segment(begin_[k], width(k));
    if (k + 1 < blocks()) part.noalias() -= left_[k + 1].transpose() * u.segment(begin_[k + 1], width(k + 1));
    diagonal_[k].transpose().triangularView<Eigen::Upper>().solveInPlace(part);
  }
  VectorXd w(u.size());
  for (std::size_t k = 0; k < blocks(); ++k) {  // w = D u
    const Index from = begin_[k == 0 ? 0 : k - 1], to = begin_[std::min(k + 2, blocks())];
    w.segment(begin_[k], width(k)).noalias() =
        d.block(begin_[k], from, width(k), to - from) * u.segment(from, to - from);
  }
  for (std::size_t k = 0; k < blocks(); ++k) {  // L x = w
    auto part = w.segment(begin_[k], width(k));
    if (k > 0) part.noalias() -= left_[k] * w.segment(begin_[k - 1], width(k - 1));
    diagonal_[k].triangularView<Eigen::Lower>().solveInPlace(part);
  }
  return w;
}

}  // namespace swarmcert::lipschitz
